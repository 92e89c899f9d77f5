"""PyTorch3D's cameras as OpenCV's.

PyTorch3D multiplies row vectors, x_camera = x_world · R + T, and its camera axes are x left, y up, z forward. Its normalised device
coordinates (NDC) grow to the left and up from the image's centre, and there are two of them; screen coordinates are pixels. In all
three the image's corner, not the centre of the first pixel, is at 0 or at the end of the range; here pixel centres are at integers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from core.errors import InvalidInput
from core.views import Camera, FloatArray

Intrinsics = Literal["ndc_isotropic", "ndc_norm_image_bounds", "screen"]
"""How focal length and principal point are given: in NDC where half of the shorter side is 1; in NDC where half of each side is 1
(PyTorch3D before 0.5, CO3D v1); or in pixels from the image's upper left corner, to the right and down."""
AXES = np.diag([-1.0, -1.0, 1.0])
"""Between PyTorch3D's camera axes and OpenCV's, in either direction."""


def camera_from_pytorch3d(
    R: FloatArray, T: FloatArray, focal: Sequence[float], principal: Sequence[float], size: tuple[int, int], intrinsics: str
) -> Camera:
    """The camera of an image.

    Args:
        R, T: shapes (3, 3) and (3,).
        focal, principal: focal length and principal point, (x, y), as `intrinsics` says.
        size: (H, W) of the image, pixels.
        intrinsics: one of `Intrinsics`.

    Raises InvalidInput for another format, or an R that is no rotation.
    """
    focal_px, centre_px = _in_pixels(np.asarray(focal, dtype=float), np.asarray(principal, dtype=float), size, intrinsics)
    K = np.array([[focal_px[0], 0, centre_px[0] - 0.5], [0, focal_px[1], centre_px[1] - 0.5], [0, 0, 1]])
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = R @ AXES
    world_from_camera[:3, 3] = -R @ T
    return Camera(K, world_from_camera)


def _in_pixels(focal: FloatArray, principal: FloatArray, size: tuple[int, int], intrinsics: str) -> tuple[FloatArray, FloatArray]:
    """Focal length and principal point in pixels, the image's corner at 0."""
    half = np.array([size[1], size[0]]) / 2
    if intrinsics == "screen":
        return focal, principal
    if intrinsics == "ndc_isotropic":
        return focal * half.min(), half - principal * half.min()
    if intrinsics == "ndc_norm_image_bounds":
        return focal * half, half - principal * half
    raise InvalidInput("intrinsics_format", f"expected one of {', '.join(get_args(Intrinsics))}, found {intrinsics!r}")
