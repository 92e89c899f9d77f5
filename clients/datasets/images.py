"""Image files as arrays.

Letters: H, W image height and width.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import InvalidInput

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp"})
"""Of files that are taken for images."""


def is_image(path: Path) -> bool:
    """Whether its name says so."""
    return path.suffix.lower() in SUFFIXES


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """Shape (H, W, 3); a grey image has three equal channels. Raises InvalidInput naming the file."""
    return np.asarray(cv2.cvtColor(_read(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB))


def read_rgba(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Colour, shape (H, W, 3), and where it is opaque, shape (H, W); None for an image without transparency."""
    image = _read(path, cv2.IMREAD_UNCHANGED)
    if image.ndim != 3 or image.shape[2] != 4 or image.dtype != np.uint8:
        return read_rgb(path), None
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2RGB)), np.asarray(image[..., 3] > 127)


def read_units(path: Path) -> NDArray[Any]:
    """A depth image's stored values, shape (H, W)."""
    image = _read(path, cv2.IMREAD_UNCHANGED)
    if image.ndim != 2:
        raise InvalidInput(str(path), f"has shape {image.shape}; depth is an image of one channel")
    return np.asarray(image)


def read_depth(path: Path, unit_m: float) -> NDArray[np.float32]:
    """z-depth in metres, shape (H, W), of an image in units of `unit_m`."""
    return np.asarray(read_units(path) * unit_m, dtype=np.float32)


def read_mask(path: Path, least: int = 1) -> NDArray[np.bool_]:
    """Where a grey image is at least `least`, shape (H, W)."""
    return np.asarray(_read(path, cv2.IMREAD_GRAYSCALE) >= least)


def write_image(path: Path, image: NDArray[Any], options: Sequence[int] = ()) -> None:
    """Writes a grey image, or one whose channels are blue, green and red, in the format of its suffix; makes its folder.

    Raises InvalidInput where that cannot be.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(path), image, list(options)):
        raise InvalidInput("out", f"{path} cannot be written")


def _read(path: Path, flags: int) -> Any:
    image = cv2.imread(str(path), flags)
    if image is None:
        found = "is no file" if not path.is_file() else "is empty" if not path.stat().st_size else "cannot be decoded"
        raise InvalidInput(str(path), f"{found}; expected an image ({', '.join(sorted(SUFFIXES))})")
    return image
