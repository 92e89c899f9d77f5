"""One uploaded image becomes an array; its header is read before its pixels.

Letters: H, W image height and width.
"""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, JpegImagePlugin, PngImagePlugin
from PIL.ImageFile import ImageFile

from core.errors import InvalidInput
from core.views import MAX_PIXELS

COLOUR_MODES = {"RGB", "RGBA", "L", "LA", "P", "PA", "1", "CMYK", "YCbCr"}
"""Of 16-bit colours the upper 8 bits are taken."""
BIT_DEPTH = 24
"""Where a PNG says how many bits a channel has."""
SATURATED = np.iinfo(np.uint16).max
MOST_SATURATED = 0.5
"""Share of the measured pixels."""
START_OF_SCAN = b"\xff\xda"
MAX_SCANS = 100
"""Of a progressive JPEG, each of which is decoded over the whole image; encoders make about ten."""
BROKEN = (OSError, SyntaxError, ValueError, TypeError, LookupError, ArithmeticError, EOFError, AttributeError, struct.error, zlib.error)
"""What decoders raise at files that are not what they say."""
SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"GIF8": "GIF",
    b"RIFF": "WebP",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"%PDF": "PDF",
    b"\x76\x2f\x31\x01": "OpenEXR",
    b"\x93NUMPY": "NumPy",
}


def decode_colour(content: bytes, field: str, *, upright: bool = False) -> NDArray[np.uint8]:
    """A JPEG or PNG as shape (H, W, 3); `upright` turns it as its EXIF says, which K and depth would not follow.

    Raises InvalidInput naming `field`.
    """
    expected = "send a JPEG or PNG colour image"
    image = _open(content, field, {"PNG", "JPEG"}, expected)
    if image.mode not in COLOUR_MODES:
        raise InvalidInput(field, f"is a 16-bit grey image, as depth is; {expected} of 8 bits a channel")
    return np.asarray((_turned(image) if upright else image).convert("RGB"), dtype=np.uint8)


def _turned(image: ImageFile) -> Image.Image:
    try:
        return ImageOps.exif_transpose(image)
    except BROKEN:  # EXIF that cannot be read says nothing
        return image


def decode_depth(content: bytes, field: str) -> NDArray[np.uint16]:
    """A 16-bit PNG of one channel as shape (H, W). Raises InvalidInput naming `field`."""
    expected = "send a 16-bit PNG of one channel, in units of depth_scale"
    image = _open(content, field, {"PNG"}, expected)
    if image.mode != "I;16":
        channels = len(image.getbands())
        raise InvalidInput(field, f"is a PNG of {content[BIT_DEPTH]} bits and {channels} channel{'s' if channels > 1 else ''}; {expected}")
    depth = np.asarray(image, dtype=np.uint16)
    saturated, measured = np.count_nonzero(depth == SATURATED), np.count_nonzero(depth)
    if saturated > MOST_SATURATED * measured:
        raise InvalidInput(
            field, f"{saturated / measured:.0%} of what it measured is {SATURATED}, the largest number there is; send 0 for not measured"
        )
    return depth


def decode_mask(content: bytes, field: str) -> NDArray[np.bool_]:
    """A PNG as shape (H, W), True where it is not black. Raises InvalidInput naming `field`."""
    image = _open(content, field, {"PNG"}, "send a PNG that is 0 outside the object and 255 on it")
    return np.asarray(np.asarray(image.convert("RGB")).any(axis=2))


def _open(content: bytes, field: str, formats: set[str], expected: str) -> ImageFile:
    kind = next((name for signature, name in SIGNATURES.items() if content.startswith(signature)), None)
    if kind not in formats:
        found = "is empty" if not content else f"is a {kind} file" if kind else "is not an image"
        raise InvalidInput(field, f"{found}; {expected}")
    if kind == "JPEG" and (scans := content.count(START_OF_SCAN)) > MAX_SCANS:
        raise InvalidInput(field, f"is a progressive JPEG of {scans} scans, at most {MAX_SCANS} are decoded; {expected}")
    try:
        # The plugins themselves, because Image.open warns of large images before their size can be judged here.
        image: ImageFile = (
            PngImagePlugin.PngImageFile(io.BytesIO(content)) if kind == "PNG" else JpegImagePlugin.JpegImageFile(io.BytesIO(content))
        )
        width, height = image.size
        if width * height > MAX_PIXELS:
            raise InvalidInput(
                field,
                f"is {width}×{height} pixels; at most {MAX_PIXELS // 1_000_000} megapixels are accepted: send it smaller, K scaled with it",
            )
        image.load()
    except InvalidInput:
        raise
    except BROKEN as error:
        raise InvalidInput(field, f"is a broken {kind} file ({error}); {expected}") from error
    return image
