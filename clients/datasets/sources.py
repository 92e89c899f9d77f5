"""One door to every data set: FORMAT:FOLDER, or a folder in the data layout."""

from __future__ import annotations

from pathlib import Path

from clients.datasets import folders
from core.errors import InvalidInput
from core.offers import Offers

FORMATS: Offers[folders.Format] = Offers("clients.datasets")


def only_sequence(data: Path | str) -> folders.Sequence:
    """The one recorded object of `data`. Raises InvalidInput where there are several, and as `find_sequences`."""
    sequences = find_sequences(data)
    if len(sequences) > 1:
        prefix, _ = _parts(data)
        one = f"{prefix}:{sequences[0].path}" if prefix else sequences[0].path
        raise InvalidInput("data", f"{data} holds {len(sequences)} objects; name one, such as {one}")
    return sequences[0]


def find_sequences(data: Path | str) -> list[folders.Sequence]:
    """Every sequence of a data set, given as FORMAT:FOLDER; a folder alone is in the data layout.

    Raises InvalidInput for an unknown format, a folder that is none, or one without sequences.
    """
    prefix, root = _parts(data)
    if prefix and prefix not in FORMATS:
        raise InvalidInput(
            "data", f"{prefix!r} in {str(data)!r} is none of {', '.join(FORMATS)}; a folder in the data layout has no prefix"
        )
    if root.is_file():
        raise InvalidInput("data", f"{root} is a file; name the folder that holds it: {prefix + ':' if prefix else ''}{root.parent}")
    if not root.is_dir():
        raise InvalidInput("data", f"{root} is no folder; name the one that holds the recordings")
    return FORMATS[prefix](root) if prefix else folders.find_sequences(root)


def _parts(data: Path | str) -> tuple[str, Path]:
    """The format's prefix, empty for the data layout, and the folder."""
    prefix, mark, rest = str(data).partition(":")
    return (prefix, Path(rest).expanduser()) if mark and not Path(data).is_dir() else ("", Path(data))
