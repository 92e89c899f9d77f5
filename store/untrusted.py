"""Reading what somebody else wrote: every size is known before anything of it is allocated, and nothing is ever unpickled."""

from __future__ import annotations

import io
import math
import re
import stat
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any

import cv2
import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from core.errors import InvalidInput
from core.views import MAX_PIXELS

FIELD = "archive"
MAX_ENTRY_BYTES = 256_000_000
"""A reference of 100 views is a tenth of it."""
MAX_ENTRIES = 100_000
MAX_HEADER_BYTES = 4096
HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
PNG_START = re.compile(rb"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR(....)(....)", re.DOTALL)


def opened(source: Path | IO[bytes], name: str) -> zipfile.ZipFile:
    """A zip file. Raises InvalidInput where it is none, OSError where it is not there."""
    try:
        return zipfile.ZipFile(source)
    except (zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, struct.error) as error:
        raise InvalidInput(FIELD, f"{name} is no zip file that can be read ({error})") from None


def entries(archive: zipfile.ZipFile, limit: int) -> dict[str, zipfile.ZipInfo]:
    """The entries of a zip file by name, all of them stored plain files that fit into its `limit` bytes. Raises InvalidInput."""
    found = archive.infolist()
    if len(found) > MAX_ENTRIES:
        raise InvalidInput(FIELD, f"has {len(found)} entries, at most {MAX_ENTRIES} are read")
    for info in found:
        kind = stat.S_IFMT(info.external_attr >> 16)
        if not info.filename or info.is_dir() or kind not in (0, stat.S_IFREG):
            raise InvalidInput(FIELD, f"{info.filename!r} is a folder, a link, a device or nameless; it may have plain files only")
        if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1 or info.compress_size != info.file_size:
            raise InvalidInput(
                FIELD, f"{info.filename!r} is compressed or encrypted; an archive of categories stores its files as they are"
            )
    if sum(info.file_size for info in found) > limit:
        raise InvalidInput(FIELD, "its entries overlap: together they are larger than the file")
    by_name = {info.filename: info for info in found}
    if len(by_name) != len(found):
        raise InvalidInput(FIELD, "has several entries of the same name")
    return by_name


def content(archive: zipfile.ZipFile, info: zipfile.ZipInfo, limit: int = MAX_ENTRY_BYTES) -> bytes:
    """An entry's bytes, as many as it says and at most `limit`. Raises InvalidInput."""
    if info.file_size > limit:
        raise InvalidInput(FIELD, f"{info.filename!r} has {info.file_size} bytes, at most {limit} are read")
    try:
        with archive.open(info) as stream:
            read = stream.read(info.file_size + 1)
    except (zipfile.BadZipFile, EOFError, OSError, NotImplementedError, RuntimeError, ValueError) as error:
        raise InvalidInput(FIELD, f"{info.filename!r} cannot be read ({error}); copy the archive again") from None
    if len(read) != info.file_size:
        raise InvalidInput(FIELD, f"{info.filename!r} has not the {info.file_size} bytes that it says")
    return read


def require_picture(picture: bytes, name: str) -> None:
    """Raises InvalidInput unless it is a PNG of a size that a camera makes."""
    start = PNG_START.match(picture)
    width, height = (int.from_bytes(each, "big") for each in start.groups()) if start else (0, 0)
    if not 0 < width * height <= MAX_PIXELS:
        raise InvalidInput(FIELD, f"{name!r} is no PNG of at most {MAX_PIXELS // 1_000_000} megapixels")
    if cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_UNCHANGED) is None:
        raise InvalidInput(FIELD, f"{name!r} cannot be decoded as PNG")


def arrays(npz: bytes, name: str) -> Mapping[str, NDArray[Any]]:
    """The arrays of an npz file: numbers and text only. Raises InvalidInput."""
    with opened(io.BytesIO(npz), name) as archive:
        found = entries(archive, len(npz))
        return {each.removesuffix(".npy"): _array(content(archive, info), f"{name}: {each}") for each, info in found.items()}


def header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of the array that a stream begins with, which is left where its content starts. Raises ValueError."""
    try:
        version = npy.read_magic(stream)
        shape, _, dtype = HEADER_READERS[version](stream, max_header_size=MAX_HEADER_BYTES)
    except (KeyError, SyntaxError, TokenError, RecursionError) as error:  # a header is parsed as Python
        raise ValueError(str(error)) from None
    return shape, dtype


def _array(written: bytes, name: str) -> NDArray[Any]:
    stream = io.BytesIO(written)
    try:
        shape, dtype = header(stream)
        if dtype.kind not in "biufU" or not dtype.itemsize:
            raise InvalidInput(FIELD, f"{name!r} has type {dtype}; only plain numbers and text are read, never pickled objects")
        if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(written) - stream.tell():
            raise InvalidInput(FIELD, f"{name!r} has not the size that its shape {shape} says")
        stream.seek(0)
        found: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
    except ValueError as error:
        raise InvalidInput(FIELD, f"{name!r} is no NumPy array ({error})") from None
    return found
