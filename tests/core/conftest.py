"""Builders shared by the tests of the method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from core.affine9 import Affine9
from core.camera_poses import hemisphere
from core.crop import Window
from core.encode import EncodedBurst, EncodedView
from core.reference import Reference, build_reference
from core.sim3 import Sim3
from core.views import Camera

GRID = 28
IMAGE = 224
IN_PLACE = Sim3.identity()
DISTANCE_M = 1.0
K = np.array([[400.0, 0, 111.5], [0, 400.0, 111.5], [0, 0, 1]])


class PaintedObject:
    """A random cloud whose points carry descriptors; views of it are encoded without images."""

    def __init__(self, seed: int = 0, points: int = 1500, dim: int = 48) -> None:
        rng = np.random.default_rng(seed)
        self.points = rng.uniform(-0.5, 0.5, (points, 3)) * np.array([0.4, 0.25, 0.15])
        frequencies = rng.normal(size=(3, dim)) * 12
        self.descriptors = np.sin(self.points @ frequencies + rng.uniform(0, 6.28, dim)).astype(np.float32)

    def reference(self, views: int) -> Reference:
        """Of so many views, in its own frame."""
        return build_reference(self.encode(views))

    def encode(self, views: int, world_from_object: Sim3 = IN_PLACE) -> EncodedBurst:
        """Views from a hemisphere about the object placed in a world; the cameras are those of a robot in that world."""
        poses = hemisphere(np.zeros(3), np.array([0.0, 0, 1]), DISTANCE_M, views)
        poses[:, :3, 3] = world_from_object.apply(poses[:, :3, 3])
        poses[:, :3, :3] = world_from_object.rotation @ poses[:, :3, :3]
        return EncodedBurst(tuple(self._view(Camera(K, pose), world_from_object) for pose in poses), "painted")

    def with_tokens(self, tokens: np.ndarray) -> EncodedBurst:
        """A burst that shows these patches, shape (V, K, D); where they are matters to nobody who asks for it."""
        view, cells = self.encode(1).views[0], np.zeros((tokens.shape[1], 2), np.int16)
        made = (
            replace(view, cells=cells, descriptors=each.astype(np.float32), pooled=each.mean(axis=0), cls=each.mean(axis=0))
            for each in tokens
        )
        return EncodedBurst(tuple(made), "painted")

    def _view(self, camera: Camera, world_from_object: Sim3) -> EncodedView:
        world = world_from_object.apply(self.points)
        pixels, depth = camera.project(world)
        cells = np.floor((pixels + 0.5) / IMAGE * GRID).astype(np.int16)[:, ::-1]
        order = np.argsort(depth)
        _, first = np.unique(cells[order], axis=0, return_index=True)
        seen = order[np.sort(first)]
        seen = seen[((cells[seen] >= 0) & (cells[seen] < GRID)).all(axis=1)]
        return EncodedView(
            GRID,
            Window(0, 0, IMAGE),
            cells[seen],
            self.descriptors[seen],
            world[seen].astype(np.float32),
            np.ones((GRID, GRID), np.float32),
            self.descriptors[seen].mean(axis=0),
            self.descriptors[seen].mean(axis=0),
            camera,
        )


@st.composite
def similarities(draw: st.DrawFn) -> Sim3:
    """Of objects up to five times as large or small."""
    numbers = st.floats(-5, 5)
    rotation = Rotation.from_rotvec([draw(numbers) for _ in range(3)]).as_matrix()
    return Sim3(draw(st.floats(0.2, 5)), rotation, np.array([draw(numbers) for _ in range(3)]))


def same(first: Sim3 | Affine9, second: Sim3 | Affine9, tolerance: float = 1e-8) -> bool:
    """Whether two transforms are one but for rounding."""
    return bool(np.allclose(first.as_matrix(), second.as_matrix(), atol=tolerance))


def turned(angle_deg: float) -> Sim3:
    """About the vertical axis."""
    return Sim3(1.0, Rotation.from_euler("z", angle_deg, degrees=True).as_matrix(), np.zeros(3))


@pytest.fixture
def painted() -> PaintedObject:
    return PaintedObject()


@pytest.fixture
def moved() -> Sim3:
    """A similarity worth recovering: 1.6 times as large, turned by 50° about a skew axis, shifted."""
    axis = np.array([0.4, -0.3, 0.866])
    return Sim3(1.6, Rotation.from_rotvec(np.radians(50) * axis / np.linalg.norm(axis)).as_matrix(), np.array([0.7, -1.1, 0.4]))


def before_the_object(view: EncodedView, share: float) -> EncodedView:
    """The same view, a share of whose patches show a hand that is nearer to the camera."""
    assert view.camera is not None
    hidden = int(share * len(view.cells))
    points = view.points_m.copy()
    points[:hidden] += 0.3 * (view.camera.world_from_camera[:3, 3] - points[:hidden])
    return replace(view, points_m=points)


def blind(burst: EncodedBurst) -> EncodedBurst:
    """The same burst without any depth."""
    return replace(burst, views=tuple(replace(view, points_m=np.full_like(view.points_m, np.nan)) for view in burst.views))


def first_patches(burst: EncodedBurst, count: int) -> EncodedBurst:
    """The same burst, of whose views only so many patches are kept."""
    kept = (
        replace(view, cells=view.cells[:count], descriptors=view.descriptors[:count], points_m=view.points_m[:count])
        for view in burst.views
    )
    return replace(burst, views=tuple(kept))
