"""A service over ASGI on a synthetic world: ellipsoids whose colour says where on the object a point is, and a backbone that reads colour.

The scene is exact, so poses are known; the backbone is fast, so every test drives the whole service.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from fastapi.testclient import TestClient

from core.backbones.base import Features
from core.scan import hemisphere
from core.sim3 import Sim3
from core.views import Burst, Camera, View
from service.app import create_app
from service.settings import Settings

SIDE, FOCAL = 160, 300.0
HALF_AXES_M = np.array([0.10, 0.07, 0.05])
COLOURS = {"bright": (190, 60), "dark": (80, 40)}
"""Middle and amplitude of the colours of two kinds of object, on a black background."""


class ColourBackbone:
    """Tokens are random Fourier features of a patch's mean colour: near colours have near tokens."""

    name = "colour"
    patch_size = 4
    dim = 64
    has_saliency = True
    fingerprint = "colour-1"

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        self._waves = rng.normal(scale=1 / 25, size=(3, self.dim))
        self._phases = rng.uniform(0, 2 * np.pi, self.dim)

    def extract(self, images: np.ndarray) -> Features:
        """See `Backbone.extract`."""
        views, side = images.shape[:2]
        grid = side // self.patch_size
        patches = images.reshape(views, grid, self.patch_size, grid, self.patch_size, 3).mean(axis=(2, 4))
        tokens = np.cos(patches @ self._waves + self._phases).astype(np.float32)
        saliency = (images.max(axis=3) > 25).astype(np.float32)
        attention = (patches.max(axis=3) > 25).astype(np.float32)
        return Features(tokens, tokens.mean(axis=(1, 2)), attention, saliency)


def render(kind: str, world_from_object: Sim3, camera: Camera) -> View:
    """An ellipsoid, each point coloured by its place on the object, with exact depth."""
    middle, amplitude = COLOURS[kind]
    pixels = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1).astype(float)
    object_from_world = world_from_object.inverse()
    origin = object_from_world.apply(camera.world_from_camera[:3, 3]) / HALF_AXES_M
    ahead = object_from_world.apply(camera.back_project(pixels, np.ones((SIDE, SIDE)))) / HALF_AXES_M - origin
    a, b, c = (ahead**2).sum(-1), (ahead * origin).sum(-1), (origin**2).sum() - 1
    root = b**2 - a * c
    hit = root > 0
    depth_m = np.where(hit, (-b - np.sqrt(np.maximum(root, 0))) / a, 0).astype(np.float32)
    colour = middle + amplitude * (origin + ahead * depth_m[..., None])
    rgb = np.where(hit[..., None], np.clip(colour, 0, 255), 0).astype(np.uint8)
    return View(rgb, depth_m, camera)


@pytest.fixture(scope="session")
def look() -> Callable[..., Burst]:
    """look(kind, views=…, world_from_object=…): a burst around an object."""

    def burst(kind: str = "bright", views: int = 6, world_from_object: Sim3 | None = None) -> Burst:
        placed = world_from_object or Sim3.identity()
        K = np.array([[FOCAL, 0, SIDE / 2], [0, FOCAL, SIDE / 2], [0, 0, 1]])
        poses = hemisphere(placed.translation, np.array([0.0, 0.0, 1.0]), 0.5 * placed.scale, views)
        return Burst([render(kind, placed, Camera(K, pose)) for pose in poses])

    return burst


@pytest.fixture(scope="session")
def parts() -> Callable[..., list[tuple[str, tuple[str, bytes, str]]]]:
    """parts(burst, edit): the multipart parts of a burst; `edit` changes the JSON part and the lists of files before they are packed."""

    def pack(burst: Burst, edit: Callable[[dict[str, Any], dict[str, list[bytes]]], None] | None = None) -> list[Any]:
        about: dict[str, Any] = {"depth_scale": 0.001, "views": []}
        files: dict[str, list[bytes]] = {"rgb": [], "depth": [], "mask": []}
        for view in burst.views:
            about["views"].append({"K": view.camera.K.tolist(), "world_from_camera": view.camera.world_from_camera.tolist()})
            files["rgb"].append(png(view.rgb[..., ::-1]))
            files["depth"].append(png(np.round(view.depth_m * 1000).astype(np.uint16)))
        if edit:
            edit(about, files)
        packed = [("burst", ("burst.json", json.dumps(about).encode(), "application/json"))]
        return packed + [
            (name, (f"{name}{index}", content, "image/png")) for name, each in files.items() for index, content in enumerate(each)
        ]

    return pack


def png(image: np.ndarray) -> bytes:
    """An image as a file."""
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.fixture(scope="session")
def npz() -> Callable[..., bytes]:
    """npz(burst, **changes): the body of application/x-npz; a change to None leaves an array out."""

    def pack(burst: Burst, **changes: Any) -> bytes:
        arrays = {
            "rgb": np.stack([view.rgb for view in burst.views]),
            "depth_m": np.stack([view.depth_m for view in burst.views]),
            "K": burst.cameras[0].K,
            "world_from_camera": np.stack([camera.world_from_camera for camera in burst.cameras]),
        } | changes
        buffer = io.BytesIO()
        np.savez(buffer, **{name: array for name, array in arrays.items() if array is not None})
        return buffer.getvalue()

    return pack


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """Settings of a small service in a temporary folder."""
    return Settings(data_dir=tmp_path / "memory", max_views=12, max_upload_mb=8)


@pytest.fixture(scope="session")
def backbone() -> ColourBackbone:
    """The one backbone of these tests."""
    return ColourBackbone()


@pytest.fixture
def client(settings: Settings, backbone: ColourBackbone) -> Iterator[TestClient]:
    """The service, started."""
    with TestClient(create_app(settings, backbone=backbone)) as opened:
        yield opened


@pytest.fixture
def learn(client: TestClient, look: Any, parts: Any) -> Callable[..., dict[str, Any]]:
    """learn(kind, name): observes, scans and completes; answers the category."""

    def category(kind: str = "bright", name: str | None = None) -> dict[str, Any]:
        burst = look(kind)
        scan = client.post("/v1/observations", files=parts(burst)).json()["scan"]
        assert client.post(f"/v1/scans/{scan['id']}/views", files=parts(burst)).status_code == 200
        answer = client.post(f"/v1/scans/{scan['id']}/complete", json={"name": name})
        assert answer.status_code == 201, answer.text
        return answer.json()

    return category
