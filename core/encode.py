"""A burst becomes descriptors: two-pass crop, tokens, foreground, 3-D points.

Letters: V views, G patches a side, P foreground patches of one view, D token size, N points of a cloud.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from core.backbones.base import Backbone, Features
from core.clock import StageClock
from core.crop import Window, close_window, largest_component
from core.depth import SAMPLES, cell_depth, reliable
from core.errors import InvalidInput, NoObject
from core.foreground import otsu_threshold, vote_by_support
from core.views import Burst, Camera, FloatArray, View

SHARED = 32
"""Views are shown a multiple of so many patches: those that see as many go through the backbone together."""
MAX_COVER = 0.95
"""A foreground that covers more of the whole image than this is a blank wall, not an object."""
COVERED = 0.5
"""Share of a patch's samples above which, being of the object, they make the patch one of its own."""

FOREGROUNDS = ("auto", "attention", "saliency")


@dataclass(frozen=True)
class EncoderConfig:
    """Settings of the crop."""

    foreground: str = "auto"
    """`attention` (the paper), `saliency` (the backbone's decoder), or `auto`: saliency where the backbone has it."""
    attention_threshold: float = 0.05
    """Share of the largest attention (appendix, "Attention maps for object detection")."""
    saliency_threshold: float = 0.5
    """Foreground probability in the first pass; the close crop's is chosen by Otsu's rule."""
    margin: float = 0.10
    """Expansion of the box (same place)."""
    first_grid: int = 16
    """Patches a side in the first pass: 224 px at 14 px a patch."""
    grid: int = 28
    """Patches a side in the close crop; the paper's feature map."""
    context: int | None = None
    """Patches around what the first pass takes for the object that the second pass sees as well; None shows it the whole crop, which takes
    longer and finds more poses where views are few."""
    context_step: int = 2
    """Of the rest of the crop, it sees one patch in so many in both directions: enough to know where the object stands."""
    context_threshold: float = 0.4
    """Foreground probability in the first pass above which the second pass looks closer."""

    def __post_init__(self) -> None:
        if self.foreground not in FOREGROUNDS:
            raise InvalidInput("foreground", f"expected one of {', '.join(FOREGROUNDS)}, found {self.foreground!r}")


@dataclass(frozen=True, eq=False)
class EncodedView:
    """The object as one view shows it."""

    grid: int
    """G."""
    window: Window
    """The close crop."""
    cells: NDArray[np.int16]
    """(row, column) of the foreground patches, shape (P, 2)."""
    descriptors: FloatArray
    """Their tokens, shape (P, D)."""
    points_m: FloatArray
    """Their points in the world frame, metres, shape (P, 3); NaN where depth was not measured."""
    saliency: FloatArray
    """Soft foreground over the close crop, shape (G, G)."""
    cls: FloatArray
    """[CLS] of the close crop, shape (D,)."""
    pooled: FloatArray
    """Mean foreground token, whitened where the backbone has statistics, shape (D,); zero where there is no foreground."""
    camera: Camera | None

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """Patches whose depth was measured, shape (P,): only these may carry geometry."""
        return np.asarray(np.isfinite(self.points_m).all(axis=1))

    def trusted_only(self) -> EncodedView:
        """The view with only its trusted patches."""
        kept = self.trusted
        return replace(self, cells=self.cells[kept], descriptors=self.descriptors[kept], points_m=self.points_m[kept])

    @property
    def pixels(self) -> FloatArray:
        """(x, y) in the image of the patches' centres, shape (P, 2)."""
        return self.window.to_pixels(self.cells, self.grid)


@dataclass(frozen=True, eq=False)
class EncodedBurst:
    """A burst's views, encoded, in the burst's order. A view in which no object was found has no patches."""

    views: tuple[EncodedView, ...]
    fingerprint: str
    """The backbone's."""
    stage_ms: dict[str, float] = field(default_factory=dict)

    @property
    def cls(self) -> FloatArray:
        """Of the views that show an object, shape (V, D)."""
        return np.stack([view.cls for view in self._shown])

    @property
    def pooled(self) -> FloatArray:
        """Of the views that show an object, shape (V, D)."""
        return np.stack([view.pooled for view in self._shown])

    @property
    def _shown(self) -> tuple[EncodedView, ...]:
        return tuple(view for view in self.views if len(view.cells))

    @cached_property
    def cloud_m(self) -> FloatArray:
        """Trusted foreground points of all views in the world frame, shape (N, 3)."""
        return np.concatenate([view.points_m[view.trusted] for view in self.views])

    def select(self, indices: list[int]) -> EncodedBurst:
        """The encoded burst of the views at `indices`."""
        return EncodedBurst(tuple(self.views[index] for index in indices), self.fingerprint)


class Encoder:
    """Turns bursts into descriptors with one backbone."""

    def __init__(self, backbone: Backbone, config: EncoderConfig | None = None) -> None:
        self.backbone = backbone
        self.config = config or EncoderConfig()

    def encode(self, burst: Burst) -> EncodedBurst:
        """See module. Raises NoObject where no view shows an object."""
        clock = StageClock()
        whole = [Window.whole(*view.size) for view in burst.views]
        coarse = self._soft_foreground(self._extract(burst, whole, self.config.first_grid))
        found = [self._find(view, window, soft) for view, window, soft in zip(burst.views, whole, coarse)]
        windows = [window or fallback for window, fallback in zip(found, whole)]
        clock.lap("find")
        shown = [self._shown(*each) for each in zip(burst.views, whole, coarse, found)]
        features = self._extract(burst, windows, self.config.grid, shown)
        fine = self._soft_foreground(features)
        clock.lap("features")
        views = []
        for index, view in enumerate(burst.views):
            soft = self._fuse(view, whole[index], coarse[index], windows[index], fine[index]) * (found[index] is not None)
            views.append(self._assemble(view, windows[index], soft, features.patches[index], features.cls[index]))
        if not any(len(view.cells) for view in views):
            raise NoObject(
                "views", "no view shows an object that stands out from its background: nothing does, or all; aim the camera or send masks"
            )
        clock.lap("points")
        return EncodedBurst(tuple(views), self.backbone.fingerprint, clock.stage_ms)

    def _extract(self, burst: Burst, windows: Sequence[Window], grid: int, shown: Sequence[NDArray[np.uint8]] = ()) -> Features:
        """Of the patches that are shown, one map of 0 and 1 a view, or of all."""
        patch = self.backbone.patch_size
        images = np.stack([window.cut(view.rgb, grid * patch) for view, window in zip(burst.views, windows)])
        if shown:
            images = np.concatenate([images, np.stack(shown).repeat(patch, axis=1).repeat(patch, axis=2)[..., None]], axis=3)
        return self.backbone.extract(images)

    def _shown(self, view: View, whole: Window, coarse: FloatArray, found: Window | None) -> NDArray[np.uint8]:
        """Which patches of the close crop the second pass sees, shape (G, G): what may be object, what is near it, some of the rest, and
        a few more, so that views share passes. Attention is relative to a whole picture, and needs it."""
        grid, context = self.config.grid, self.config.context
        shown = np.ones((grid, grid), np.uint8)
        if found is None:
            return np.zeros_like(shown)
        if context is None or self._source == "attention":
            return shown
        soft = found.cut(whole.paste(coarse, view.size) if view.mask is None else view.mask.astype(np.float32), grid)
        away = cv2.distanceTransform((soft <= self.config.context_threshold).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        away[:: self.config.context_step, :: self.config.context_step] = 0
        count = -(-np.count_nonzero(away <= context) // SHARED) * SHARED
        shown.flat[np.argsort(away, axis=None, kind="stable")[count:]] = 0
        return shown

    def _find(self, view: View, whole: Window, soft: FloatArray) -> Window | None:
        """The close window of the object; None where nothing stands out, or everything does."""
        if view.mask is None:
            component = largest_component(soft, self._threshold)
        else:
            component = np.asarray(whole.cut(view.mask.astype(np.uint8), max(view.size), nearest=True)) > 0
        if not component.any() or (view.mask is None and component.mean() > MAX_COVER):
            return None
        return close_window(component, whole, self.config.margin)

    def _fuse(self, view: View, whole: Window, coarse: FloatArray, window: Window, fine: FloatArray) -> FloatArray:
        """Soft foreground of the close crop, shape (G·SAMPLES, G·SAMPLES)."""
        side = self.config.grid * SAMPLES
        if view.mask is not None:
            return np.asarray(window.cut(view.mask.astype(np.float32), side, nearest=True))
        second = cv2.resize(fine, (side, side), interpolation=cv2.INTER_AREA if len(fine) > side else cv2.INTER_LINEAR)
        if self._source == "attention":
            return np.asarray(second)
        first = window.cut(whole.paste(coarse, view.size), side)
        soft = np.clip((first + second) / 2, 0, 1)
        if view.depth_m is None or view.camera is None:
            return soft
        depth, usable = _cut_depth(view, view.depth_m, window, side)
        cells = np.argwhere(np.ones_like(usable))
        points = view.camera.in_camera(window.to_pixels(cells, side), depth.reshape(-1)).reshape(side, side, 3)
        return vote_by_support(
            soft, points, usable, window.size / float(view.camera.K[0, 0]) * float(np.median(depth[usable])) if usable.any() else 1.0
        )

    def _assemble(self, view: View, window: Window, soft: FloatArray, tokens: FloatArray, cls: FloatArray) -> EncodedView:
        grid = self.config.grid
        inside = self._component(soft)
        foreground = inside.reshape(grid, SAMPLES, grid, SAMPLES).mean(axis=(1, 3)) > COVERED
        cells = np.argwhere(foreground).astype(np.int16)
        points = np.full((len(cells), 3), np.nan, dtype=np.float32)
        if view.depth_m is not None and view.camera is not None and len(cells):
            depth, usable = _cut_depth(view, view.depth_m, window, grid * SAMPLES)
            depths = cell_depth(depth, usable & inside, grid)[foreground]
            points = view.camera.back_project(window.to_pixels(cells, grid), depths).astype(np.float32)
        small = soft.reshape(grid, SAMPLES, grid, SAMPLES).mean(axis=(1, 3)).astype(np.float32)
        return EncodedView(grid, window, cells, tokens[foreground], points, small, cls, self._pool(tokens[foreground]), view.camera)

    def _pool(self, tokens: FloatArray) -> FloatArray:
        if not len(tokens):
            return np.zeros(self.backbone.dim, dtype=np.float32)
        mean = tokens.mean(axis=0)
        return mean if self.backbone.whitening is None else self.backbone.whitening.apply(mean)

    def _component(self, soft: FloatArray) -> NDArray[np.bool_]:
        """The object in the close crop; nothing where nothing is clearly foreground."""
        if self._source == "attention" or soft.max() <= self.config.saliency_threshold:
            return largest_component(soft, self._threshold)
        return largest_component(soft, otsu_threshold(soft))

    @property
    def _source(self) -> str:
        if self.config.foreground != "auto":
            return self.config.foreground
        return "saliency" if self.backbone.has_saliency else "attention"

    @property
    def _threshold(self) -> float:
        return self.config.saliency_threshold if self._source == "saliency" else self.config.attention_threshold

    def _soft_foreground(self, features: Features) -> FloatArray:
        if self._source == "attention":
            return features.attention
        if features.saliency is None:
            raise InvalidInput("foreground", f"backbone {self.backbone.name} has no saliency decoder; use 'attention'")
        return features.saliency


def _cut_depth(view: View, depth_m: FloatArray, window: Window, side: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Depth of the crop, never interpolated, and where it may be used; both (side, side)."""
    usable = window.cut(reliable(depth_m).astype(np.uint8), side, nearest=True)
    return np.asarray(window.cut(depth_m, side, nearest=True)), np.asarray(usable) > 0
