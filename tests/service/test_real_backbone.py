"""The whole loop over HTTP with the embedded backbone on recorded objects: learn one, know it again elsewhere, tell another apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.spatial.transform import Rotation

from clients.datasets.folders import find_sequences, load_burst
from core.sim3 import Sim3, rotation_angle_deg
from core.views import Burst, Camera
from service.app import create_app

MOVED = Sim3(1.2, Rotation.from_rotvec([0.5, -0.8, 0.3]).as_matrix(), np.array([0.3, 0.1, -0.4]))


@pytest.fixture
def service(settings, embedded_backbone):
    """The service with its real backbone."""
    with TestClient(create_app(settings, backbone=embedded_backbone)) as client:
        yield client


@pytest.fixture
def recorded(samples):
    """recorded(name, indices): views of a sample."""

    def views(name, indices):
        (sequence,) = find_sequences(samples / name)
        return load_burst(sequence, indices)

    return views


def moved(burst):
    """The same views in a world that is turned, shifted and larger."""

    def view(each):
        pose = np.eye(4)
        pose[:3, :3] = MOVED.rotation @ each.camera.world_from_camera[:3, :3]
        pose[:3, 3] = MOVED.apply(each.camera.world_from_camera[:3, 3])
        return replace(each, depth_m=each.depth_m * np.float32(MOVED.scale), camera=Camera(each.camera.K, pose))

    return Burst([view(each) for each in burst.views])


def test_learn_one_know_it_elsewhere_tell_another_apart(service, parts, recorded):
    scanned = recorded("tv/tv_1", range(0, 12, 3))
    novel = service.post("/v1/observations", files=parts(scanned.select([0, 2]))).json()
    assert novel["outcome"] == "novel"
    for view in range(len(scanned)):
        assert service.post(f"/v1/scans/{novel['scan']['id']}/views", files=parts(scanned.select([view]))).status_code == 200
    category = service.post(f"/v1/scans/{novel['scan']['id']}/complete", json={"name": "tv"}).json()

    seen = service.post("/v1/observations", files=parts(moved(scanned))).json()
    assert (seen["outcome"], seen["category_id"]) == ("known", category["id"])
    found = Sim3.from_matrix(np.array(seen["pose"]["target_from_reference"]["matrix"]))
    assert rotation_angle_deg(found.rotation, MOVED.rotation) < 1
    assert found.scale == pytest.approx(MOVED.scale, rel=0.01)
    for name in ("overlay", "correspondences", "pca", "foreground"):
        assert service.get(f"/v1/observations/{seen['id']}/{name}.png").headers["content-type"] == "image/png"

    other = service.post("/v1/observations", files=parts(recorded("car/car_baja-bug", range(0, 12, 6)))).json()
    assert other["outcome"] == "novel"
