"""Encoding real sample views with the real backbone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clients.datasets.folders import Sequence, find_sequences, load_burst
from core.backbones.base import Backbone
from core.encode import EncodedBurst, Encoder, EncoderConfig
from core.errors import InvalidInput, NoObject
from core.pose import PoseEstimator
from core.reference import build_reference
from core.sim3 import Sim3, rotation_angle_deg
from core.views import Burst, Camera, View


@pytest.fixture(scope="module")
def backbone(embedded_backbone: Backbone) -> Backbone:
    return embedded_backbone


@pytest.fixture(scope="module")
def sequence(samples: Path) -> Sequence:
    return find_sequences(samples)[0]


@pytest.fixture(scope="module")
def burst(sequence: Sequence) -> Burst:
    return load_burst(sequence, [0, 3, 6, 9])


@pytest.fixture(scope="module")
def encoded(backbone: Backbone, burst: Burst) -> EncodedBurst:
    return Encoder(backbone).encode(burst)


@pytest.mark.parametrize("foreground", ["attention", "saliency"])
def test_the_object_is_found_without_its_mask(foreground: str, backbone: Backbone, sequence: Sequence) -> None:
    burst = load_burst(sequence, [0], masks=True)
    mask = burst.views[0].mask
    assert mask is not None
    found = Encoder(backbone, EncoderConfig(foreground=foreground)).encode(Burst([replace(burst.views[0], mask=None)])).views[0]
    x, y = found.pixels.round().astype(int).T
    assert mask[y, x].mean() > 0.75, "most foreground patches lie on the object"
    assert len(found.cells) * (found.window.size / found.grid) ** 2 > 0.6 * mask.sum(), "and cover most of it"


def test_a_second_pass_that_sees_less_finds_the_same_object(backbone: Backbone, burst: Burst, encoded: EncodedBurst) -> None:
    near = Encoder(backbone, EncoderConfig(context=2)).encode(burst)
    for view, whole in zip(near.views, encoded.views, strict=True):
        assert view.window == whole.window
        both = {tuple(cell) for cell in view.cells} & {tuple(cell) for cell in whole.cells}
        assert len(both) > 0.9 * max(len(view.cells), len(whole.cells))


def test_points_lie_on_the_object(encoded: EncodedBurst, sequence: Sequence) -> None:
    assert sequence.world_from_model is not None
    in_model = sequence.world_from_model.inverse().apply(encoded.cloud_m)
    assert (np.linalg.norm(in_model, axis=1) < 0.6).mean() > 0.95


def test_encoding_again_gives_the_same_numbers(encoded: EncodedBurst, backbone: Backbone, burst: Burst) -> None:
    again = Encoder(backbone).encode(burst)
    assert all(np.array_equal(first.descriptors, second.descriptors) for first, second in zip(encoded.views, again.views, strict=True))


def moved_burst(burst: Burst, moved: Sim3) -> Burst:
    """The same pictures of an object `scale` times as large in another world."""
    views = []
    for view in burst.views:
        assert view.camera is not None
        assert view.depth_m is not None
        pose = view.camera.world_from_camera.copy()
        pose[:3, :3], pose[:3, 3] = moved.rotation @ pose[:3, :3], moved.apply(pose[:3, 3])
        views.append(View(view.rgb, (view.depth_m * moved.scale).astype(np.float32), Camera(view.camera.K, pose)))
    return Burst(views)


def test_a_similarity_applied_to_real_views_is_recovered(encoded: EncodedBurst, backbone: Backbone, burst: Burst, moved: Sim3) -> None:
    target = Encoder(backbone).encode(moved_burst(burst, moved))
    found = PoseEstimator().estimate(build_reference(encoded), target).target_from_reference
    assert rotation_angle_deg(found.rotation, moved.rotation) < 1
    assert abs(np.log(found.scale / moved.scale)) < 0.02
    assert np.linalg.norm(found.translation - moved.translation) < 0.02


def test_a_mask_replaces_attention(backbone: Backbone, burst: Burst) -> None:
    mask = np.zeros(burst.views[0].size, dtype=bool)
    mask[40:80, 60:120] = True
    view = Encoder(backbone).encode(Burst([replace(burst.views[0], mask=mask)])).views[0]
    x, y = view.pixels.T
    assert ((x > 58) & (x < 121) & (y > 38) & (y < 81)).all()


def test_a_blank_wall_shows_no_object(backbone: Backbone) -> None:
    wall = View(np.full((240, 320, 3), 128, np.uint8))
    with pytest.raises(NoObject, match="send masks"):
        Encoder(backbone).encode(Burst([wall]))


def test_an_unknown_foreground_is_refused() -> None:
    with pytest.raises(InvalidInput, match="^foreground: expected one of auto, attention, saliency, found 'depth'"):
        EncoderConfig(foreground="depth")


def test_saliency_of_a_backbone_without_it_is_refused(burst: Burst, backbone: Backbone, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(backbone, "has_saliency", False)
    monkeypatch.setattr(backbone, "_decoder", None)
    with pytest.raises(InvalidInput, match="attention"):
        Encoder(backbone, EncoderConfig(foreground="saliency")).encode(burst)
