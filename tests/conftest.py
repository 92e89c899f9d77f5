"""What every test may rely on: an environment without the user's settings, the same examples on every run, and a synthetic world.

The world is made of ellipsoids whose colour says where on the object a point is, and its backbone reads colour: it is fast, and poses
are known exactly.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pytest
from hypothesis import settings

from core.backbones.base import Backbone, Features, shown_patches
from core.camera_poses import hemisphere
from core.sim3 import Sim3
from core.views import Burst, Camera, View

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from service.settings import Settings

settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")

HALF_AXES_M = np.array([0.10, 0.07, 0.05])
COLOURS = {"bright": (190, 60), "dark": (80, 40)}
"""Middle and amplitude of the colours of two kinds of object."""


class ColourBackbone:
    """Tokens are random Fourier features of a patch's mean colour: near colours have near tokens; what is not black is foreground."""

    name = "colour"
    patch_size = 4
    dim = 64
    has_saliency = True
    whitening = None
    fingerprint = "colour-1"

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        self._waves = rng.normal(scale=1 / 25, size=(3, self.dim))
        self._phases = rng.uniform(0, 2 * np.pi, self.dim)
        self.calls = 0

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """See `Backbone.extract`; counts its calls."""
        self.calls += 1
        views, side = images.shape[:2]
        grid = side // self.patch_size
        shown = shown_patches(images, self.patch_size).reshape(views, grid, grid)
        images = images[..., :3] * shown.repeat(self.patch_size, axis=1).repeat(self.patch_size, axis=2)[..., None]
        patches = images.reshape(views, grid, self.patch_size, grid, self.patch_size, 3).mean(axis=(2, 4))
        tokens = (np.cos(patches @ self._waves + self._phases) * shown[..., None]).astype(np.float32)
        attention, saliency = ((each.max(axis=3) > 25).astype(np.float32) for each in (patches, images))
        return Features(tokens, tokens.mean(axis=(1, 2)), attention, saliency)


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """An object on a black background, each point coloured by its place on the object."""

    half_axes: NDArray[np.floating]
    """In the object frame, shape (3,)."""
    colour: tuple[float, float] = (190, 60)
    """Middle and amplitude."""
    SIDE: ClassVar[int] = 160
    """Of the images, pixels."""
    K: ClassVar[NDArray[np.floating]] = np.array([[300.0, 0, 80], [0, 300, 80], [0, 0, 1]])

    def view(self, world_from_object: Sim3, world_from_camera: NDArray[np.floating]) -> View:
        """What a camera sees, with exact depth."""
        camera = Camera(self.K, world_from_camera)
        pixels = np.stack(np.meshgrid(np.arange(self.SIDE), np.arange(self.SIDE)), axis=-1).astype(float)
        object_from_world = world_from_object.inverse()
        origin = object_from_world.apply(world_from_camera[:3, 3]) / self.half_axes
        ahead = object_from_world.apply(camera.back_project(pixels, np.ones(pixels.shape[:2]))) / self.half_axes - origin
        a, b, c = (ahead**2).sum(-1), (ahead * origin).sum(-1), (origin**2).sum() - 1
        root = b**2 - a * c
        hit = root > 0
        depth_m = np.where(hit, (-b - np.sqrt(np.maximum(root, 0))) / a, 0).astype(np.float32)
        middle, amplitude = self.colour
        shade = middle + amplitude * (origin + ahead * depth_m[..., None])
        return View(np.where(hit[..., None], np.clip(shade, 0, 255), 0).astype(np.uint8), depth_m, camera)


@pytest.fixture(autouse=True)
def no_user_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hides the user's ONELOOK_* settings; ONELOOK_CACHE stays, since the weights are in it."""
    for name in os.environ:
        if name.startswith("ONELOOK_") and name != "ONELOOK_CACHE":
            monkeypatch.delenv(name)


@pytest.fixture(scope="session")
def samples() -> Path:
    """The repository's recordings: real images, in the data layout."""
    return Path(__file__).parent / "data" / "bursts"


@pytest.fixture(scope="session")
def recorded(samples: Path) -> Callable[[str, range], Burst]:
    """recorded(name, indices): views of a sample."""

    from clients.datasets.folders import find_sequences, load_burst

    def views(name: str, indices: range) -> Burst:
        (sequence,) = find_sequences(samples / name)
        return load_burst(sequence, indices)

    return views


@pytest.fixture
def backbone() -> ColourBackbone:
    """A backbone that is there at once."""
    return ColourBackbone()


@pytest.fixture(scope="session")
def colour_backbone() -> ColourBackbone:
    """The same one for all tests."""
    return ColourBackbone()


@pytest.fixture(scope="session")
def ellipsoid() -> type[Ellipsoid]:
    """The object of the synthetic world."""
    return Ellipsoid


@pytest.fixture(scope="session")
def look() -> Callable[..., Burst]:
    """look(kind, views=…, world_from_object=…, poses=…): a burst around an object, or from these camera poses."""

    def burst(kind: str = "bright", views: int = 6, world_from_object: Sim3 | None = None, poses: Any = None) -> Burst:
        placed = world_from_object or Sim3.identity()
        if poses is None:
            poses = hemisphere(placed.translation, np.array([0.0, 0.0, 1.0]), 0.5 * placed.scale, views)
        shown = Ellipsoid(HALF_AXES_M, COLOURS[kind])
        return Burst([shown.view(placed, pose) for pose in poses])

    return burst


@pytest.fixture(scope="session")
def embedded_backbone() -> Backbone:
    """The real one, loaded once for all tests."""
    from core.backbones import load_backbone

    return load_backbone()


@pytest.fixture(scope="session")
def prove_backbone() -> Callable[[Backbone], None]:
    """prove_backbone(backbone): it keeps what `Backbone` promises."""
    return _prove_backbone


def _prove_backbone(backbone: Backbone) -> None:
    grid, side = 8, 8 * backbone.patch_size
    images = np.random.default_rng(0).integers(0, 255, (3, side, side, 3)).astype(np.uint8)
    whole = _arrays(backbone.extract(images))
    shapes = {"patches": (3, grid, grid, backbone.dim), "cls": (3, backbone.dim), "attention": (3, grid, grid)}
    if backbone.has_saliency:
        shapes["saliency"] = (3, side, side)
    assert {name: array.shape for name, array in whole.items()} == shapes
    for name, array in whole.items():
        assert array.dtype == np.float32, name
        assert np.isfinite(array).all(), name
    for name in shapes.keys() - {"patches", "cls"}:
        assert whole[name].min() >= 0, name
        assert whole[name].max() <= 1, name
    assert np.allclose(whole["attention"].max(axis=(1, 2)), 1)
    assert backbone.fingerprint
    for index in range(3):  # what an image gives is its own, whatever comes with it
        for name, array in _arrays(backbone.extract(images[index : index + 1])).items():
            assert _alike(array[0], whole[name][index]), name

    shown = np.zeros((3, grid, grid), np.uint8)
    shown[0, 1:4, 2:5], shown[1] = 1, 1  # a part, all, nothing
    alpha = shown.repeat(backbone.patch_size, axis=1).repeat(backbone.patch_size, axis=2)[..., None]
    parts, scribbled = (
        _arrays(backbone.extract(np.concatenate([each, alpha], axis=3))) for each in (images, np.where(alpha, images, 255 - images))
    )
    for name, array in parts.items():
        assert np.array_equal(array, scribbled[name]), name  # what is transparent lends no context
        assert _alike(array[1], whole[name][1]), name
        assert not array[2].any(), name
    hidden = {"patches": shown == 0, "attention": shown == 0, "saliency": alpha[..., 0] == 0}
    for name in parts.keys() - {"cls"}:
        assert not parts[name][hidden[name]].any(), name
    assert parts["patches"][shown > 0].any(axis=1).all()


def _arrays(features: Features) -> dict[str, NDArray[np.float32]]:
    return {name: array for name, array in vars(features).items() if array is not None}


def _alike(first: NDArray[np.float32], second: NDArray[np.float32]) -> bool:
    """As far as products of half precision allow."""
    return bool(np.abs(first - second).max() <= 0.02 * np.abs(second).max())


@contextmanager
def _serving(settings: Settings, backbone: Backbone) -> Iterator[str]:
    """The address of a live service."""
    import uvicorn

    from service.app import create_app

    app = create_app(settings, backbone=backbone)
    server = uvicorn.Server(uvicorn.Config(app, host="127.0.0.1", port=0, log_level="warning", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the service did not start; its log says why"
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


@pytest.fixture(scope="session")
def serving() -> Callable[[Settings, Backbone], AbstractContextManager[str]]:
    """serving(settings, backbone): a live service, whose address it gives."""
    return _serving
