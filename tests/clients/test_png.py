"""Images as PNG, read back by another library."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from clients.png import encode_png

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    "image",
    [
        RNG.integers(0, 65536, (7, 5)).astype(np.uint16),
        RNG.integers(0, 256, (48, 64)).astype(np.uint8),
        np.full((1, 1), 258, np.uint16),
        np.arange(6, dtype=np.uint16).reshape(2, 3)[:, ::-1],
    ],
    ids=["16 bits", "8 bits", "one pixel", "not contiguous"],
)
def test_every_pixel_comes_back(image: NDArray[np.uint16]) -> None:
    read = cv2.imdecode(np.frombuffer(encode_png(image), np.uint8), cv2.IMREAD_UNCHANGED)
    assert read.dtype == image.dtype
    np.testing.assert_array_equal(read, image)
