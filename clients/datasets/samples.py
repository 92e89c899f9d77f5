"""The recordings that come with the repository: what runs where no other data is named."""

from __future__ import annotations

from pathlib import Path

from core.errors import InvalidInput

SAMPLES = Path(__file__).resolve().parents[2] / "tests" / "data" / "bursts"


def data_or_samples(data: Path | None) -> Path:
    """`data`, or the samples where it is None. Raises InvalidInput where they are not there: an installed package has none."""
    if data is None and not SAMPLES.is_dir():
        raise InvalidInput("--data", f"no sample bursts at {SAMPLES}; run from a clone of the repository, or name a folder of recordings")
    return data or SAMPLES
