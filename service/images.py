"""One uploaded image becomes an array; its header is read before its pixels.

Letters: H, W image height and width.
"""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import JpegImagePlugin, PngImagePlugin
from PIL.ImageFile import ImageFile

from core.errors import InvalidInput
from core.views import MAX_PIXELS

COLOUR_MODES = {"RGB", "RGBA", "L", "LA", "P", "CMYK"}
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


def decode_colour(content: bytes, field: str) -> NDArray[np.uint8]:
    """A JPEG or PNG as shape (H, W, 3). Raises InvalidInput naming `field`."""
    expected = "send a JPEG or PNG colour image"
    image = _open(content, field, {"PNG", "JPEG"}, expected)
    if image.mode not in COLOUR_MODES:
        raise InvalidInput(field, f"is a 16-bit grey image, as depth is; {expected} of 8 bits a channel")
    return np.asarray(image.convert("RGB"), dtype=np.uint8)


def decode_depth(content: bytes, field: str) -> NDArray[np.uint16]:
    """A 16-bit PNG of one channel as shape (H, W). Raises InvalidInput naming `field`."""
    expected = "send a 16-bit PNG of one channel, in units of depth_scale"
    image = _open(content, field, {"PNG"}, expected)
    if image.mode != "I;16":
        channels = len(image.getbands())
        raise InvalidInput(field, f"is an 8-bit PNG of {channels} channel{'s' if channels > 1 else ''}; {expected}")
    return np.asarray(image, dtype=np.uint16)


def decode_mask(content: bytes, field: str) -> NDArray[np.bool_]:
    """A PNG as shape (H, W), True where it is not black. Raises InvalidInput naming `field`."""
    image = _open(content, field, {"PNG"}, "send a PNG that is 0 outside the object and 255 on it")
    return np.asarray(np.asarray(image.convert("RGB")).any(axis=2))


def _open(content: bytes, field: str, formats: set[str], expected: str) -> ImageFile:
    kind = next((name for signature, name in SIGNATURES.items() if content.startswith(signature)), None)
    if kind not in formats:
        found = "is empty" if not content else f"is a {kind} file" if kind else "is not an image"
        raise InvalidInput(field, f"{found}; {expected}")
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
    except (OSError, SyntaxError, ValueError) as error:
        raise InvalidInput(field, f"is a broken {kind} file ({error}); {expected}") from error
    return image
