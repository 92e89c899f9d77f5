"""Every curl of docs/http.md works, one after the other, against a live service, and so does its Python."""

from __future__ import annotations

import asyncio
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from core.backbones.base import Features
from service.settings import Settings

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "http.md"
NPZ, FOLLOW = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
SCRIPT = "\n".join(re.findall(r"^```sh\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL))


@pytest.fixture
def url(settings: Any, backbone: Any, serving: Any) -> Iterator[str]:
    """A live service that takes the middle of every image for the object."""

    class Middle(type(backbone)):  # type: ignore[misc]
        def extract(self, images: np.ndarray) -> Features:
            found = super().extract(images)
            disc = np.zeros(images.shape[1:3], np.float32)
            cv2.circle(disc, (len(disc) // 2, len(disc) // 2), round(0.35 * len(disc)), 1.0, -1)
            small = cv2.resize(disc, found.attention.shape[1:], interpolation=cv2.INTER_AREA)
            return Features(found.patches, found.cls, np.stack([small] * len(images)), np.stack([disc] * len(images)))

    with serving(settings.model_copy(update={"score": Settings().score}), Middle()) as address:
        yield address


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_every_curl_of_the_page_works(url: str, tmp_path: Path) -> None:
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    assert SCRIPT.count("curl -s ") + SCRIPT.count("curl -sN ") == len(re.findall(r"^\s*curl ", SCRIPT, re.MULTILINE)) > 30
    script = SCRIPT.replace("http://127.0.0.1:8000", url).replace("curl -s", "curl --fail-with-body --show-error -s")
    ran = subprocess.run(["bash", "-exc", script], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, f"{ran.stdout[-500:]}\n{ran.stderr[-2000:]}"
    for picture in tmp_path.glob("*.png"):
        assert cv2.imread(str(picture)) is not None, picture.name


def test_an_npz_file_as_the_page_makes_it_is_a_burst(url: str, look: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    views = look(views=2).views
    arrays = {
        "rgb": np.stack([view.rgb for view in views]),
        "depth_m": np.stack([view.depth_m for view in views]),
        "K": np.stack([view.camera.K for view in views]),
        "world_from_camera": np.stack([view.camera.world_from_camera for view in views]),
    }
    exec(compile(NPZ, PAGE.name, "exec"), {"numpy": np, **arrays})
    body = (tmp_path / "burst.npz").read_bytes()
    answer = httpx.post(f"{url}/v1/observations", content=body, headers={"Content-Type": "application/x-npz"})
    assert (answer.status_code, answer.json()["outcome"]) == (201, "novel")


def test_the_pages_client_follows_frames(url: str, look: Any, capsys: pytest.CaptureFixture[str]) -> None:
    def frame(view: Any) -> Any:
        depth_mm = np.round(1000 * view.depth_m).astype(np.uint16)
        images = (cv2.imencode(".jpg", view.rgb[..., ::-1])[1].tobytes(), cv2.imencode(".png", depth_mm)[1].tobytes())
        return (*images, view.camera.K.tolist(), view.camera.world_from_camera.tolist())

    names: dict[str, Any] = {}
    exec(compile(FOLLOW.replace("ws://127.0.0.1:8000", url.replace("http", "ws")), PAGE.name, "exec"), names)
    asyncio.run(names["follow"]([frame(view) for view in look(views=2).views], None))
    assert capsys.readouterr().out == "ready\nNone None\nNone None\n"  # the memory is empty
