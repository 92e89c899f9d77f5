"""Multipart bodies become bursts.

Letters: V views, H, W image height and width.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from core.errors import InvalidInput
from core.views import Burst, Camera, FloatArray, View
from service.errors import field_path
from service.images import decode_colour, decode_depth, decode_mask
from service.plausibility import plausible
from service.schemas.bursts import BurstPart, matrix

ABOUT_BYTES = 8192
"""Of JSON for a view; its 25 numbers take a tenth of it."""


@dataclass(frozen=True)
class BurstLimits:
    """What one burst may have."""

    views: int
    megapixels: int
    """Of its colour images together."""

    def require_views(self, field: str, views: int) -> None:
        """Raises InvalidInput naming `field`."""
        if not 1 <= views <= self.views:
            raise InvalidInput(field, f"has {views} images; a burst has 1 to {self.views} views (ONELOOK_MAX_VIEWS)")

    def require_pixels(self, field: str, pixels: int) -> None:
        """Raises InvalidInput naming `field`."""
        if pixels > self.megapixels * 1_000_000:
            raise InvalidInput(
                field,
                f"its images have more than {self.megapixels} megapixels together (ONELOOK_MAX_MEGAPIXELS); send smaller or fewer ones",
            )


@dataclass(frozen=True)
class Parts:
    """A multipart body as it came."""

    burst: str | bytes
    rgb: Sequence[bytes]
    depth: Sequence[bytes]
    mask: Sequence[bytes]


@dataclass(frozen=True)
class Upload:
    """A decoded body."""

    burst: Burst
    frame: str | None


def decode_parts(parts: Parts, limits: BurstLimits) -> Upload:
    """From multipart/form-data. Raises InvalidInput naming the part that is wrong."""
    about = _about(parts.burst, limits)
    views = len(parts.rgb)
    limits.require_views("rgb", views)
    for name, found in (("depth", len(parts.depth)), ("mask", len(parts.mask)), ("views", len(about.views or ()))):
        if found not in (0, views):
            raise InvalidInput(name, f"has {found} entries for {views} rgb images; send one a view, in the same order, or none")
    alone = not (about.views or parts.depth or parts.mask)
    rgb = _images(parts.rgb, "rgb", lambda content, field: decode_colour(content, field, upright=alone), limits)
    depth_m = [(image * about.depth_scale).astype(np.float32) for image in _images(parts.depth, "depth", decode_depth, limits)]
    mask = _images(parts.mask, "mask", decode_mask, limits)
    cameras = [(matrix(view.K, 3), matrix(view.world_from_camera, 4)) for view in about.views or ()]
    return Upload(assemble(rgb, depth_m, mask, cameras), about.frame)


def assemble(
    rgb: Sequence[NDArray[np.uint8]],
    depth_m: Sequence[NDArray[np.float32]],
    mask: Sequence[NDArray[np.bool_]],
    cameras: Sequence[tuple[FloatArray | None, FloatArray | None]],
) -> Burst:
    """A burst from its parts, each with one entry a view or none at all.

    Args:
        rgb: shapes (H, W, 3).
        depth_m, mask: shapes (H, W).
        cameras: K, shape (3, 3), and world_from_camera, shape (4, 4).

    Raises InvalidInput, also where only a part of the cameras is there, or depth is and they are not.
    """
    given = any(value is not None for camera in cameras for value in camera)
    if given or depth_m:
        for index in range(len(rgb)):
            K, pose = cameras[index] if cameras else (None, None)
            for name, value in (("K", K), ("world_from_camera", pose)):
                if value is None:
                    why = "other cameras are given" if given else "depth is given, and says nothing without cameras"
                    raise InvalidInput(f"views[{index}].{name}", f"is missing, while {why}; send K and world_from_camera for every view")
    views = []
    for index, image in enumerate(rgb):
        with naming(f"views[{index}]."):
            K, pose = cameras[index] if given else (None, None)
            camera = Camera(K, pose) if K is not None and pose is not None else None
            views.append(plausible(View(image, depth_m[index] if depth_m else None, camera, mask[index] if mask else None)))
    return Burst(views)


@contextmanager
def naming(within: str) -> Iterator[None]:
    """A camera or a view does not know where in a request it is; the caller's error names its field behind `within`."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are refused
            yield
    except InvalidInput as error:
        raise InvalidInput(within + error.field.partition(".")[2], error.message) from None


def _about(part: str | bytes, limits: BurstLimits) -> BurstPart:
    most = ABOUT_BYTES * (limits.views + 1)
    if len(part) > most:
        raise InvalidInput("burst", f"has {len(part)} bytes; the cameras of {limits.views} views (ONELOOK_MAX_VIEWS) take less than {most}")
    try:
        return BurstPart.model_validate_json(part)
    except ValidationError as error:
        first = error.errors()[0]
        # Views are named as in an npz, where there is no part `burst`.
        field = field_path(first["loc"] if first["loc"][:1] == ("views",) else ("burst", *first["loc"]))
        if first["type"] == "json_invalid":
            raise InvalidInput(
                field, f'is not JSON ({first["ctx"]["error"]}); send an object such as {{"depth_scale": 0.001, "views": […]}}'
            ) from None
        raise InvalidInput(field, first["msg"].removeprefix("Value error, ")) from None


def _images(contents: Sequence[bytes], name: str, decode: Callable[[bytes, str], NDArray[Any]], limits: BurstLimits) -> list[NDArray[Any]]:
    images, pixels = [], 0
    for index, content in enumerate(contents):
        images.append(decode(content, f"views[{index}].{name}"))
        pixels += images[-1].shape[0] * images[-1].shape[1]
        limits.require_pixels(name, pixels)
    return images
