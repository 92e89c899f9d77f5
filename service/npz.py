"""Bodies of one npz file become bursts: headers are read before arrays, and nothing is ever unpickled.

Letters: V views, H, W image height and width.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from tokenize import TokenError
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from core.errors import InvalidInput
from service.decoding import MAX_BURST_PIXELS, Upload, assemble, require_view_count

DIMENSIONS = {"rgb": (4,), "depth_m": (3,), "K": (2, 3), "world_from_camera": (3,), "mask": (3,)}
"""The arrays that may be sent, and how many dimensions each may have."""
HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
MAX_HEADER_BYTES = 4096


def decode_npz(body: bytes, max_views: int) -> Upload:
    """From application/x-npz. Raises InvalidInput naming the array that is wrong."""
    arrays = _arrays(body)
    rgb = arrays.get("rgb")
    if rgb is None:
        raise InvalidInput(
            "rgb", f"is missing; the npz has {', '.join(sorted(arrays)) or 'nothing'}, expected rgb (V, H, W, 3) of uint8 at least"
        )
    views = len(rgb)
    require_view_count("rgb", views, max_views)
    K, poses = arrays.get("K"), arrays.get("world_from_camera")
    if K is not None and K.ndim == 2:
        K = arrays["K"] = np.repeat(K[None], views, axis=0)
    for name, array in arrays.items():
        if len(array) != views:
            raise InvalidInput(name, f"has {len(array)} entries for {views} rgb images; send one a view, in the same order")
    cameras = [(None if K is None else K[view], None if poses is None else poses[view]) for view in range(views)]
    with np.errstate(over="ignore"):  # becomes infinite, which the view refuses
        depth_m = [depth.astype(np.float32) for depth in arrays.get("depth_m", ())]
    masks = [np.asarray(mask != 0) for mask in arrays.get("mask", ())]
    return Upload(assemble(list(rgb), depth_m, masks, cameras), None)


def _arrays(body: bytes) -> dict[str, NDArray[Any]]:
    try:
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            return {name: _array(archive, name) for name in map(_array_name, archive.namelist())}
    except (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise InvalidInput("body", f"is not a readable npz file ({error}); write it with numpy.savez") from None


def _array_name(entry: str) -> str:
    name = entry.removesuffix(".npy")
    if name not in DIMENSIONS or name == entry:
        raise InvalidInput(name, f"is not expected in the npz; it may have {', '.join(DIMENSIONS)}")
    return name


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    with archive.open(f"{name}.npy") as stream:
        shape, dtype = _header(stream, name)
    if dtype.kind not in "buif":
        raise InvalidInput(name, f"has type {dtype}; send plain numbers, never pickled objects")
    if len(shape) not in DIMENSIONS[name]:
        dimensions = " or ".join(map(str, DIMENSIONS[name]))
        raise InvalidInput(name, f"expected {dimensions} dimensions, found shape {shape}")
    if math.prod(shape) * dtype.itemsize > 8 * MAX_BURST_PIXELS:
        raise InvalidInput(
            name, f"has shape {shape} of {dtype}: more than {MAX_BURST_PIXELS // 1_000_000} megapixels; send smaller or fewer views"
        )
    with archive.open(f"{name}.npy") as stream:
        try:
            array: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
        except ValueError as error:
            raise InvalidInput(name, f"cannot be read ({error}); write the npz with numpy.savez") from None
    return array


def _header(stream: IO[bytes], name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    try:
        version = npy.read_magic(stream)
        shape, _, dtype = HEADER_READERS[version](stream, max_header_size=MAX_HEADER_BYTES)
    except (ValueError, KeyError, SyntaxError, TokenError, RecursionError) as error:  # a header is parsed as Python
        raise InvalidInput(name, f"is not a NumPy array ({error}); write the npz with numpy.savez") from None
    return shape, dtype
