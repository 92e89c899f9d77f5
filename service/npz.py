"""Bodies of one npz file become bursts: headers are read before arrays, and nothing is ever unpickled.

Letters: V views, H, W image height and width.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from core.errors import InvalidInput
from service.decoding import BurstLimits, Upload, assemble
from store.untrusted import header

DIMENSIONS = {"rgb": (4,), "depth_m": (3,), "K": (2, 3), "world_from_camera": (3,), "mask": (3,)}
"""The arrays that may be sent, and how many dimensions each may have."""
IMAGES = ("rgb", "depth_m", "mask")
EXPECTED = {
    "rgb": "(V, H, W, 3)",
    "depth_m": "(V, H, W)",
    "mask": "(V, H, W)",
    "K": "(3, 3) or (V, 3, 3)",
    "world_from_camera": "(V, 4, 4)",
}
COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Those that NumPy writes; others unpack to thousands of times their size, and fail in ways of their own."""
LARGEST_MATRIX = 4
"""Rows and columns of a camera's matrices."""


def decode_npz(body: bytes, limits: BurstLimits) -> Upload:
    """From application/x-npz. Raises InvalidInput naming the array that is wrong."""
    arrays = _arrays(body, limits)
    rgb = arrays["rgb"]
    views = len(rgb)
    K, poses = arrays.get("K"), arrays.get("world_from_camera")
    if K is not None and K.ndim == 2:
        K = arrays["K"] = np.repeat(K[None], views, axis=0)
    # Whole numbers are of types that cannot be negated.
    K, poses = (None if each is None else each.astype(float) for each in (K, poses))
    cameras = [(None if K is None else K[view], None if poses is None else poses[view]) for view in range(views)]
    with np.errstate(over="ignore"):  # becomes infinite, which the view refuses
        depth_m = [depth.astype(np.float32) for depth in arrays.get("depth_m", ())]
    masks = [np.asarray(mask != 0) for mask in arrays.get("mask", ())]
    return Upload(assemble(list(rgb), depth_m, masks, cameras), None)


def _arrays(body: bytes, limits: BurstLimits) -> dict[str, NDArray[Any]]:
    try:
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            entries = archive.infolist()
            if len(entries) > len(DIMENSIONS):
                raise InvalidInput("body", f"has {len(entries)} arrays; it may have {', '.join(DIMENSIONS)}, each once")
            shapes = {name: _shape(archive, name) for name in map(_array_name, entries)}
            _require_together(shapes, limits)
            return {name: _array(archive, name) for name in shapes}
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise InvalidInput("body", f"is not a readable npz file ({error}); write it with numpy.savez") from None


def _array_name(entry: zipfile.ZipInfo) -> str:
    name = entry.filename.removesuffix(".npy")
    if name not in DIMENSIONS or name == entry.filename:
        raise InvalidInput(name, f"is not expected in the npz; it may have {', '.join(DIMENSIONS)}")
    if entry.compress_type not in COMPRESSIONS:
        raise InvalidInput(name, "is compressed in a way that NumPy does not; write the npz with numpy.savez or numpy.savez_compressed")
    return name


def _require_together(shapes: dict[str, tuple[int, ...]], limits: BurstLimits) -> None:
    """All of it is judged before anything of it is allocated: no array is much larger than the colour images are allowed to be."""
    rgb = shapes.get("rgb")
    if rgb is None:
        raise InvalidInput(
            "rgb", f"is missing; the npz has {', '.join(sorted(shapes)) or 'nothing'}, expected rgb (V, H, W, 3) of uint8 at least"
        )
    limits.require_views("rgb", rgb[0])
    limits.require_pixels("rgb", math.prod(rgb[:3]))
    if rgb[3] != 3:
        raise InvalidInput("rgb", f"has shape {rgb}, expected (V, H, W, 3)")
    for name, shape in shapes.items():
        if name == "K" and len(shape) == 2:
            shape = (rgb[0], *shape)
        if shape[0] != rgb[0]:
            raise InvalidInput(name, f"has {shape[0]} entries for {rgb[0]} rgb images; send one a view, in the same order")
        side = max(rgb[1:3]) if name in IMAGES else LARGEST_MATRIX
        if max(shape[1:]) > side:
            raise InvalidInput(name, f"has shape {shape}, which fits no {rgb[2]}×{rgb[1]} images; send {EXPECTED[name]}")


def _shape(archive: zipfile.ZipFile, name: str) -> tuple[int, ...]:
    with archive.open(f"{name}.npy") as stream:
        try:
            shape, dtype = header(stream)
        except ValueError as error:
            raise InvalidInput(name, f"is not a NumPy array ({error}); write the npz with numpy.savez") from None
    if dtype.kind not in "buif":
        raise InvalidInput(name, f"has type {dtype}; send plain numbers, never pickled objects")
    if len(shape) not in DIMENSIONS[name]:
        dimensions = " or ".join(map(str, DIMENSIONS[name]))
        raise InvalidInput(name, f"expected {dimensions} dimensions, found shape {shape}")
    return shape


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(f"{name}.npy") as stream:
        try:
            array: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
        except ValueError as error:
            raise InvalidInput(name, f"cannot be read ({error}); write the npz with numpy.savez") from None
    return array
