"""Every burst of a data folder, encoded once and kept in the user's cache.

A cached file is named by what it depends on: the sequence's images, depth and cameras, the backbone's fingerprint, the
encoder's configuration, and the source of the code that encodes. It is plain arrays (npz), never pickled.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.cached import code_hash, write
from benchmarks.parallel import bar
from clients.datasets import folders
from core.backbones.weights import cache_folder
from core.encode import EncodedBurst, Encoder
from core.errors import NoObject
from core.packing import burst_as_arrays, burst_from_arrays
from core.view_consistency import consistent_only

SOURCES = (
    "views.py",
    "encode.py",
    "crop.py",
    "depth.py",
    "foreground.py",
    "packing.py",
    "backbones/base.py",
    "backbones/dino.py",
    "backbones/saliency.py",
    "backbones/whitening.py",
)
"""Files of core/ that decide what an encoding is, beside the backbone's own: a changed method never meets an old cache."""


def encode_all(sequences: Sequence[folders.Sequence], encoder: Encoder, folder: Path | None = None) -> list[Path]:
    """The cached file of every sequence, all its views, encoding those that have none, with a progress bar.

    Args:
        folder: where the files are kept; `encoded/` in the cache folder where None.

    Raises NoObject, naming the sequence, where one has no view with an object.
    """
    files = [(folder or cache_folder() / "encoded") / f"{_key(sequence, encoder)}.npz" for sequence in sequences]
    missing = [(sequence, file) for sequence, file in zip(sequences, files, strict=True) if not file.exists()]
    with bar(disable=not missing) as progress:
        task = progress.add_task("encoding", total=len(missing))
        for sequence, file in missing:
            progress.update(task, description=f"encoding {sequence.name}")
            try:
                write_encoded(file, encoder.encode(folders.load_burst(sequence)))
            except NoObject as error:
                raise NoObject(sequence.name, error.message) from error
            progress.advance(task)
    return files


@lru_cache(maxsize=16)
def read_encoded(file: Path) -> EncodedBurst:
    """What `encode_all` kept in `file`."""
    with np.load(file, allow_pickle=False) as arrays:
        stage_ms = dict(zip(arrays["stages"].tolist(), arrays["stage_ms"].tolist(), strict=True))
        return replace(burst_from_arrays(arrays), stage_ms=stage_ms)


def read_views(file: Path, indices: list[int] | None = None) -> EncodedBurst:
    """The views at `indices`, all where None, as the service would have them of a robot that sent no others."""
    whole = read_encoded(file)
    return consistent_only(whole if indices is None else whole.select(indices))


def write_encoded(file: Path, encoded: EncodedBurst) -> None:
    """Keeps what `read_encoded` reads."""
    arrays: dict[str, NDArray[Any]] = {
        **burst_as_arrays(encoded),
        "stages": np.array(list(encoded.stage_ms), dtype=np.str_),
        "stage_ms": np.array(list(encoded.stage_ms.values()), dtype=float),
    }
    write(file, lambda stream: np.savez(stream, allow_pickle=False, **arrays))


def encoder_key(encoder: Encoder) -> str:
    """What an encoding depends on beside the burst."""
    backbone = getattr(encoder.backbone, "inner", encoder.backbone)  # of one that remembers, the one that looks
    own = hashlib.sha256(Path(inspect.getfile(type(backbone))).read_bytes()).hexdigest()
    return f"{encoder.backbone.fingerprint} {encoder.config} {code_hash(SOURCES)} {own}"


def _key(sequence: folders.Sequence, encoder: Encoder) -> str:
    digest = hashlib.sha256(encoder_key(encoder).encode())
    digest.update(sequence.reader.cameras(sequence).encode())
    for file in sequence.reader.files(sequence):
        if file.exists():
            digest.update(f"{file.relative_to(sequence.path)}\0".encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:32]
