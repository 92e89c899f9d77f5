"""What the pose benchmark compares: found by name, honest about what they give, and refusing what means nothing to them."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from benchmarks import contenders
from benchmarks.contenders import contender, without_depth
from clients.datasets.folders import find_sequences, load_burst
from clients.pose_error import pose_error, rotation_error_deg
from core.encode import EncodedBurst, Encoder
from core.errors import InvalidInput, NoPose
from core.pose import PoseEstimator, PoseOptions

TOKEN_SIZE = 64


@pytest.fixture
def eggs(recorded: Path, backbone) -> list[tuple[EncodedBurst, object]]:
    """Each object's encoded burst and its world_from_model."""
    return [(Encoder(backbone).encode(load_burst(each)), each.world_from_model) for each in find_sequences(recorded)]


@pytest.mark.parametrize("name", contenders.NAMES)
def test_every_contender_has_a_name_and_travels_between_processes(name: str) -> None:
    found = contender(name, PoseOptions(), TOKEN_SIZE)
    assert found.variant == name
    assert pickle.loads(pickle.dumps(found)) == found


@pytest.mark.parametrize(("token_size", "dims"), [(384, 32), (8, 8)])
def test_a_row_tells_of_no_more_components_than_a_token_has(token_size: int, dims: int) -> None:
    assert contender("best", PoseOptions(dims=32), token_size).dims == dims


@pytest.mark.parametrize("name", ["pnp", "essential"])
def test_without_depth_the_rotation_is_found_and_scale_only_where_it_can_be(name: str, eggs: list) -> None:
    (large, reference_from_model), (small, target_from_model) = eggs
    way = contender(name, PoseOptions(), TOKEN_SIZE)
    found = way.find(way.learn(large)[0], small, 0)
    assert rotation_error_deg(found.rotation, reference_from_model, target_from_model) < 20  # neighbouring views are 90° apart
    assert (found.similarity is None, found.matrix is None) == ((True, True) if name == "essential" else (False, False))
    if found.similarity is not None:
        assert pose_error(found.similarity, reference_from_model, target_from_model).log_scale < 0.1


def test_no_depth_is_given_to_those_that_go_without(eggs: list, monkeypatch: pytest.MonkeyPatch) -> None:
    given = []
    monkeypatch.setattr(PoseEstimator, "estimate", lambda self, reference, target, seed: given.append((reference, target)) or _stop())
    way = contender("pnp", PoseOptions(), TOKEN_SIZE)
    with pytest.raises(NoPose):
        way.find(way.learn(eggs[0][0])[0], eggs[1][0], 0)
    ((reference, target),) = given
    assert len(reference.cloud_m)
    assert not len(target.cloud_m)
    assert not len(contender("essential", PoseOptions(), TOKEN_SIZE).learn(eggs[0][0])[0].views[0].trusted.nonzero()[0])


def _stop() -> None:
    raise NoPose("watched")


@pytest.mark.parametrize("name", ["fpfh", "fgr"])
def test_clouds_alone_give_a_similarity_scaled_by_their_extents(name: str, eggs: list) -> None:
    (large, reference_from_model), (small, target_from_model) = eggs
    way = contender(name, PoseOptions(), TOKEN_SIZE)
    first, again = (way.find(way.learn(large)[0], small, 0) for _ in range(2))
    error = pose_error(first.similarity, reference_from_model, target_from_model)
    assert error.log_scale < 0.15
    assert error.translation < 0.3  # on an ellipsoid, no more can be asked of shape
    assert np.array_equal(first.matrix, again.matrix)
    assert np.isclose(np.linalg.det(first.rotation), 1)


@pytest.mark.parametrize("name", ["fpfh", "fgr"])
def test_an_object_without_depth_cannot_be_registered(name: str, eggs: list) -> None:
    way = contender(name, PoseOptions(), TOKEN_SIZE)
    with pytest.raises(NoPose, match="no depth"):
        way.find(eggs[0][0], without_depth(eggs[1][0]), 0)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("essential", PoseOptions(inlier_ratio=0.1)),
        ("essential", PoseOptions(dof=9)),
        ("essential", PoseOptions(method="cyclical-3d")),
        ("fpfh", PoseOptions(dims=32)),
        ("fgr", PoseOptions(estimator="ransac")),
        ("nonsense", PoseOptions()),
    ],
)
def test_what_means_nothing_to_a_contender_is_refused(name: str, options: PoseOptions) -> None:
    (field,) = [key for key, value in vars(options).items() if value is not None] or ["variant"]
    with pytest.raises(InvalidInput) as caught:
        contender(name, options, TOKEN_SIZE)
    assert caught.value.field == field
