"""Cameras, views and bursts: frozen, and checked when they are made.

Letters: H, W image height and width in pixels.
Camera axes are OpenCV's (x right, y down, z forward); lengths are metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.errors import InvalidInput

FloatArray = NDArray[np.floating]
ROTATION_TOLERANCE = 1e-3
"""Largest entry of |RᵀR − I| that still counts as a rotation (float32 JSON round trips reach about 1e-6)."""
ENTRY_TOLERANCE = 1e-6
"""How far an entry of K or of a pose may be off the 0 or 1 that it must be: as far as such round trips put it."""
MAX_DEPTH_M = 100.0
"""No indoor RGB-D camera measures farther; larger values are millimetres sent as metres."""
MIN_DEPTH_M = 0.01
"""No RGB-D camera measures nearer; smaller values were made by a depth_scale of another unit."""
MAX_PIXELS = 16_000_000
"""Largest image accepted, in pixels."""
MIN_SIDE = 32
"""Least height and width accepted, in pixels: about one for each patch of a close crop, below which there is nothing to see."""
MAX_OFF_CENTRE = 0.2
"""How far the principal point may be off the image's centre, as a share of its width or height: a lens sits within a few hundredths, and K
of an image of half the size puts it a quarter off."""


def require_rotation(rotation: FloatArray, field: str) -> None:
    """Raises InvalidInput unless `rotation`, shape (3, 3), is orthonormal and right-handed."""
    error = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    if error > ROTATION_TOLERANCE:
        raise InvalidInput(
            field, f"its upper-left 3×3 block is not a rotation (|RᵀR − I| is {error:.2g}); send an orthonormal matrix without scale"
        )
    if np.linalg.det(rotation) < 0:
        raise InvalidInput(field, "its rotation is left-handed (determinant −1); use OpenCV's camera axes: x right, y down, z forward")


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera with a pose."""

    K: FloatArray
    """Intrinsics in pixels, shape (3, 3)."""
    world_from_camera: FloatArray
    """Rigid transform, shape (4, 4), metres, OpenCV camera axes."""

    def __post_init__(self) -> None:
        self.validate("camera")

    def validate(self, field: str) -> None:
        """Raises InvalidInput naming `field`."""
        for name, shape in (("K", (3, 3)), ("world_from_camera", (4, 4))):
            value = np.asarray(getattr(self, name))
            if value.shape != shape:
                raise InvalidInput(f"{field}.{name}", f"expected shape {shape}, found {value.shape}")
            if not np.isfinite(value).all():
                raise InvalidInput(f"{field}.{name}", "has NaN or infinite entries")
        K, pose = self.K, self.world_from_camera
        if K[0, 0] <= 0 or K[1, 1] <= 0 or not np.allclose(K[2], [0, 0, 1], atol=ENTRY_TOLERANCE) or abs(K[1, 0]) > ENTRY_TOLERANCE:
            raise InvalidInput(f"{field}.K", "expected [[fx, s, cx], [0, fy, cy], [0, 0, 1]] in pixels with fx, fy > 0")
        if not np.allclose(pose[3], [0, 0, 0, 1], atol=ENTRY_TOLERANCE):
            raise InvalidInput(f"{field}.world_from_camera", f"its last row must be [0, 0, 0, 1], found {np.round(pose[3], 4).tolist()}")
        require_rotation(pose[:3, :3], f"{field}.world_from_camera")

    @property
    def camera_from_world(self) -> FloatArray:
        """Rigid inverse of `world_from_camera`, shape (4, 4)."""
        rotation = self.world_from_camera[:3, :3]
        inverse = np.eye(4)
        inverse[:3, :3] = rotation.T
        inverse[:3, 3] = -rotation.T @ self.world_from_camera[:3, 3]
        return inverse

    def back_project(self, pixels: FloatArray, depth_m: FloatArray) -> FloatArray:
        """World points, shape (..., 3), of pixels (x, y), shape (..., 2), at z-depths in metres, shape (...).

        Pixel centres are at integers.
        """
        return self.in_camera(pixels, depth_m) @ self.world_from_camera[:3, :3].T + self.world_from_camera[:3, 3]

    def in_camera(self, pixels: FloatArray, depth_m: FloatArray) -> FloatArray:
        """Points in the camera's frame, shape (..., 3), of pixels (x, y), shape (..., 2), at z-depths in metres, shape (...)."""
        y = (pixels[..., 1] - self.K[1, 2]) / self.K[1, 1]
        x = (pixels[..., 0] - self.K[0, 2] - self.K[0, 1] * y) / self.K[0, 0]
        return np.stack([x * depth_m, y * depth_m, depth_m], axis=-1)

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pixels (x, y), shape (..., 2), and z-depths in metres, shape (...), of world points, shape (..., 3)."""
        in_camera = (points - self.world_from_camera[:3, 3]) @ self.world_from_camera[:3, :3]
        depth = in_camera[..., 2]
        homogeneous = in_camera @ self.K.T
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = homogeneous[..., :2] / homogeneous[..., 2:3]
        return pixels, depth


@dataclass(frozen=True, eq=False)
class View:
    """One image, with what is known of its depth and camera."""

    rgb: NDArray[np.uint8]
    """Shape (H, W, 3)."""
    depth_m: NDArray[np.float32] | None = None
    """z-depth in metres, shape (H, W); 0 where nothing was measured."""
    camera: Camera | None = None
    mask: NDArray[np.bool_] | None = None
    """The object's silhouette where the caller knows it, shape (H, W); else the object is found by attention."""

    def __post_init__(self) -> None:
        self.validate("view")

    @property
    def size(self) -> tuple[int, int]:
        """(H, W) in pixels."""
        return self.rgb.shape[0], self.rgb.shape[1]

    def validate(self, field: str) -> None:
        """Raises InvalidInput naming the part of `field` that is wrong."""
        if self.rgb.ndim != 3 or self.rgb.shape[2] != 3 or self.rgb.dtype != np.uint8:
            raise InvalidInput(f"{field}.rgb", f"expected (H, W, 3) of uint8, found {self.rgb.shape} of {self.rgb.dtype}")
        height, width = self.size
        if min(height, width) < MIN_SIDE or height * width > MAX_PIXELS:
            raise InvalidInput(
                f"{field}.rgb",
                f"is {width}×{height} pixels; expected at least {MIN_SIDE} a side and at most {MAX_PIXELS // 1_000_000} megapixels",
            )
        if self.camera is not None:
            self.camera.validate(field)
            cx, cy = float(self.camera.K[0, 2]), float(self.camera.K[1, 2])
            if not (0 < cx < width and 0 < cy < height):
                raise InvalidInput(
                    f"{field}.K",
                    f"its principal point ({cx:.0f}, {cy:.0f}) is outside the {width}×{height} image; scale K to this resolution",
                )
            if max(abs(cx / width - 0.5), abs(cy / height - 0.5)) > MAX_OFF_CENTRE:
                raise InvalidInput(
                    f"{field}.K",
                    f"its principal point ({cx:.0f}, {cy:.0f}) is far from the centre of the {width}×{height} image: K is of another size",
                )
        self._validate_depth(field)
        if self.mask is not None:
            if self.mask.shape != (height, width):
                raise InvalidInput(f"{field}.mask", f"expected {width}×{height} pixels like rgb, found shape {self.mask.shape}")
            if not self.mask.any():
                raise InvalidInput(f"{field}.mask", "is empty; leave it out to have the object found by attention")

    def _validate_depth(self, field: str) -> None:
        depth = self.depth_m
        if depth is None:
            return
        if depth.shape != self.size:
            raise InvalidInput(
                f"{field}.depth",
                f"expected {self.size[1]}×{self.size[0]} pixels like rgb (align depth to colour), found shape {depth.shape}",
            )
        if not np.isfinite(depth).all():
            raise InvalidInput(f"{field}.depth", "has NaN or infinite values; send 0 where nothing was measured")
        measured = depth[depth != 0]
        if measured.size == 0:
            raise InvalidInput(f"{field}.depth", "is zero everywhere; leave the depth out or check the camera's depth stream")
        if (measured < 0).any():
            raise InvalidInput(f"{field}.depth", "has negative values; z-depth is positive in front of the camera")
        median = float(np.median(measured))
        if median > MAX_DEPTH_M:
            raise InvalidInput(f"{field}.depth", f"its median is {median:.0f} m: millimetres sent as metres? Set depth_scale to 0.001")
        if median < MIN_DEPTH_M:
            raise InvalidInput(
                f"{field}.depth", f"its median is {median * 1000:.2g} mm: depth_scale is metres a unit, so 0.001 for millimetre images"
            )


@dataclass(frozen=True, eq=False)
class Burst:
    """Views of one object, all in one world frame."""

    views: tuple[View, ...]

    def __init__(self, views: Sequence[View]) -> None:
        object.__setattr__(self, "views", tuple(views))
        if not self.views:
            raise InvalidInput("views", "a burst needs at least one view, found none")
        for index, view in enumerate(self.views):
            view.validate(f"views[{index}]")

    def __len__(self) -> int:
        return len(self.views)

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera of every view. Raises InvalidInput where one is missing."""
        return tuple(require_camera(view.camera, index) for index, view in enumerate(self.views))

    def select(self, indices: Sequence[int]) -> Burst:
        """The burst of the views at `indices`, in that order."""
        return Burst([self.views[index] for index in indices])


def require_camera(camera: Camera | None, index: int) -> Camera:
    """That of the view at `index`. Raises InvalidInput where there is none."""
    if camera is None:
        raise InvalidInput(f"views[{index}].K", "is missing: a pose needs K and world_from_camera for every view")
    return camera
