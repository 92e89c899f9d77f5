"""A service over ASGI on the synthetic world: its backbone is fast, so every test drives the whole service."""

from __future__ import annotations

import base64
import io
import json
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from fastapi.testclient import TestClient

from core.backbones.base import Backbone, Features
from core.views import Burst
from service.app import create_app
from service.settings import Settings
from store.keys import ROLES, Keys

LONG_S = 60.0


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


def colour_only(about: dict[str, Any], files: dict[str, list[bytes]]) -> None:
    """An edit of `parts` that leaves photographs: neither cameras nor depth."""
    del about["views"]
    files["depth"].clear()


class Gate:
    """A backbone whose passes wait until they are let through."""

    def __init__(self, backbone: Backbone) -> None:
        self.__dict__.update(
            {name: getattr(backbone, name) for name in ("name", "patch_size", "dim", "has_saliency", "whitening", "fingerprint")}
        )
        self._backbone = backbone
        self.open, self.entered = threading.Event(), threading.Event()
        self.passes: list[int] = []
        """Images of each."""

    def extract(self, images: np.ndarray) -> Features:
        """See `Backbone.extract`."""
        self.passes.append(len(images))
        self.entered.set()
        self.open.wait(LONG_S)
        return self._backbone.extract(images)


def until(what: Callable[[], object]) -> None:
    """Waits for it."""
    end = time.monotonic() + LONG_S
    while not what():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.01)


def png(image: np.ndarray) -> bytes:
    """An image as a file."""
    return cv2.imencode(".png", image)[1].tobytes()


def as_text(image: np.ndarray) -> str:
    """An image as a message of WS /v1/track has it."""
    return base64.b64encode(png(image)).decode()


def picture(answer: httpx.Response) -> np.ndarray:
    """The image of an answer, shape (H, W, 3), RGB."""
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png"), answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


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


def small_service(folder: Path) -> Settings:
    """Settings of one whose memory is there."""
    return Settings(data_dir=folder, max_views=12, max_upload_mb=8, variant="ucd", score="pooled_best_view")


def with_keys(keys: Keys) -> dict[str, dict[str, str]]:
    """A new key of each role: by role the header that it travels in."""
    return {role: {"Authorization": f"Bearer {keys.create(role, role)[1]}"} for role in ROLES}


@pytest.fixture
def settings(tmp_path: Path, request: pytest.FixtureRequest) -> Settings:
    """Settings of a small service in a temporary folder, whose memory is empty unless the test asks for `ball`."""
    settings = small_service(tmp_path / "memory")
    if "ball" in request.fixturenames:
        shutil.copytree(request.getfixturevalue("ball_memory")[0], settings.data_dir)
    return settings


@pytest.fixture
def client(settings: Settings, backbone: Backbone) -> Iterator[TestClient]:
    """The service, started."""
    with TestClient(create_app(settings, backbone=backbone)) as opened:
        yield opened


@pytest.fixture
def learn(client: TestClient, look: Any, parts: Any) -> Callable[..., dict[str, Any]]:
    """learn(kind, name): observes, scans and completes; answers the category."""

    return lambda kind="bright", name=None: learnt(client, parts(look(kind)), name)


def learnt(client: TestClient, burst: Any, name: str | None) -> dict[str, Any]:
    """The category that a burst is observed, scanned and completed to."""
    scan = client.post("/v1/observations", files=burst).json()["scan"]
    assert client.post(f"/v1/scans/{scan['id']}/views", files=burst).status_code == 200
    answer = client.post(f"/v1/scans/{scan['id']}/complete", json={"name": name})
    assert answer.status_code == 201, answer.text
    return answer.json()


def lose_answers(client: TestClient) -> None:
    """As if the process had ended between what it did and what it said."""
    with client.app.state.running.agent.memory._connection.housekeeping() as db:
        db.execute("UPDATE requests SET status = NULL, media_type = NULL, body = NULL")


@pytest.fixture(scope="session")
def ball_memory(tmp_path_factory: Any, colour_backbone: Any, look: Any, parts: Any) -> tuple[Path, dict[str, Any]]:
    """A memory that learnt a ball, to be copied, since learning takes half a second; and that category."""
    folder = tmp_path_factory.mktemp("ball") / "memory"
    with TestClient(create_app(small_service(folder), backbone=colour_backbone)) as client:
        return folder, learnt(client, parts(look("bright")), "ball")


@pytest.fixture
def ball(ball_memory: tuple[Path, dict[str, Any]]) -> dict[str, Any]:
    """A category that the service knows from its start; the observation and the scan that made it are kept, too."""
    return dict(ball_memory[1])


@pytest.fixture
def live(settings: Settings, backbone: Backbone, serving: Any) -> Iterator[str]:
    """The address of a live service with an empty memory."""
    with serving(settings, backbone) as url:
        yield url
