"""What a real RGB-D camera on an arm makes of an ideal picture: noise, blur, a stereo camera's depth, a calibration a little off.

Letters: H, W pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clients.simulator.raycast.render import LitScene, Rendered
from core.views import Camera, FloatArray, View

Generator = np.random.Generator


@dataclass(frozen=True)
class SensorConfig:
    """Of a small active-stereo camera; lengths in metres."""

    size: tuple[int, int] = (480, 640)
    """(H, W)."""
    focal_px: float = 580.0
    blur_px: float = 0.6
    noise: float = 0.010
    """Of a colour, 1 being white."""
    baseline_m: float = 0.055
    disparity_noise_px: float = 0.08
    disparity_step_px: float = 1 / 16
    range_m: tuple[float, float] = (0.2, 4.0)
    speckle: float = 0.012
    """Share of pixels in blotches without depth."""
    edge_loss: float = 0.5
    """Share of pixels beside a step in depth that have none."""
    grazing: float = 0.12
    """Cosine to a surface's normal below which the pattern is not seen on it."""
    hand_eye_deg: float = 0.2
    hand_eye_m: float = 0.0015
    """The camera is turned and shifted by this against where the robot believes it is: the same for every view."""
    jitter_deg: float = 0.04
    jitter_m: float = 0.0004
    """The same, anew for every view: an arm repeats a pose no better."""

    @property
    def K(self) -> FloatArray:
        """Intrinsics, shape (3, 3)."""
        height, width = self.size
        return np.array([[self.focal_px, 0, (width - 1) / 2], [0, self.focal_px, (height - 1) / 2], [0, 0, 1.0]])


class Sensor:
    """One camera: its calibration error is its own."""

    def __init__(self, config: SensorConfig, calibration: Generator, noise: Generator) -> None:
        self.config = config
        self._rng = noise
        self._hand_eye = _small_motion(calibration, config.hand_eye_deg, config.hand_eye_m)

    def look(self, scene: LitScene, world_from_camera: FloatArray, *, mask_of: int | None = None) -> View:
        """The view from where the robot believes its camera to be, which is what the view's camera says.

        Args:
            mask_of: an object whose silhouette to add, for evaluation.
        """
        config = self.config
        true = world_from_camera @ self._hand_eye @ _small_motion(self._rng, config.jitter_deg, config.jitter_m)
        eye = Camera(config.K, true)
        ideal = scene.render(eye, config.size)
        mask = None if mask_of is None else ideal.shows == mask_of
        measured = self._stereo(ideal)
        return View(
            self._colour(ideal.rgb),
            measured if measured.any() else None,
            Camera(config.K, world_from_camera),
            mask if mask is not None and mask.any() else None,
        )

    def _colour(self, rgb: NDArray[np.float32]) -> NDArray[np.uint8]:
        if self.config.blur_px:
            rgb = np.asarray(cv2.GaussianBlur(rgb, (0, 0), self.config.blur_px))
        grain = self._rng.standard_normal(rgb.shape, dtype=np.float32) * np.float32(self.config.noise)
        return np.asarray(((rgb + grain) * 255).round().clip(0, 255), np.uint8)

    def _stereo(self, ideal: Rendered) -> NDArray[np.float32]:
        config, shape = self.config, ideal.depth_m.shape
        near, far = config.range_m
        depth = ideal.depth_m
        seen = (depth > near) & (depth < far) & (ideal.slant > config.grazing)
        disparity = config.focal_px * config.baseline_m / np.where(seen, depth, 1.0)
        seen &= ~_hidden(config.focal_px * config.baseline_m / depth)
        seen &= ~self._lost(disparity, shape)
        noise = self._rng.standard_normal(shape, dtype=np.float32)
        smooth = cv2.GaussianBlur(self._rng.standard_normal(shape, dtype=np.float32), (0, 0), 2.0) * 5.0  # of about unit deviation
        disparity = disparity + config.disparity_noise_px * (0.5 * noise + 0.85 * smooth)
        if config.disparity_step_px:
            disparity = np.round(disparity / config.disparity_step_px) * config.disparity_step_px
        measured = config.focal_px * config.baseline_m / np.maximum(disparity, 1e-3)
        return np.where(seen & (measured < far), measured, 0).astype(np.float32)

    def _lost(self, disparity: FloatArray, shape: tuple[int, ...]) -> NDArray[np.bool_]:
        """Beside steps in depth, and in blotches."""
        chance = self._rng.random(shape, dtype=np.float32)
        step = cv2.morphologyEx(disparity.astype(np.float32), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 2.0
        blotch = cv2.GaussianBlur(self._rng.standard_normal((shape[0] // 2, shape[1] // 2), dtype=np.float32), (0, 0), 1.5)
        limit = np.quantile(blotch[::4, ::4], 1 - self.config.speckle) if self.config.speckle else np.inf
        blotches = cv2.resize(blotch, shape[::-1], interpolation=cv2.INTER_LINEAR) > limit
        return np.asarray((step & (chance < self.config.edge_loss)) | blotches)


def _hidden(disparity: FloatArray) -> NDArray[np.bool_]:
    """What the second eye, to the right, does not see, shape (H, W): the shadows beside near things.

    A place is behind what lies to the right of it, in its row, and is nearer by more pixels of disparity than it is pixels away. Past a
    thing thinner than its shadow the eye sees such a place again, but in another order than the first eye, which matching does not follow.
    """
    seen_at = disparity - np.arange(disparity.shape[1], dtype=np.float32)
    nearest = np.maximum.accumulate(seen_at[:, ::-1], axis=1)[:, ::-1]
    hidden = np.zeros(disparity.shape, dtype=bool)
    hidden[:, :-1] = nearest[:, 1:] > seen_at[:, :-1]
    return hidden


def _small_motion(rng: Generator, angle_deg: float, offset_m: float) -> FloatArray:
    """A rigid transform near the identity, shape (4, 4)."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(np.radians(angle_deg) * rng.normal(size=3) / np.sqrt(3)).as_matrix()
    motion[:3, 3] = offset_m * rng.normal(size=3) / np.sqrt(3)
    return motion
