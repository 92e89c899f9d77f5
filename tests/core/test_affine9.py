"""The 9-D transform acts on points as its parts say; its fit recovers what was applied and refuses what it cannot determine."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from core.affine9 import Affine9, fit_affine9
from core.errors import InvalidInput, NoPose
from core.sim3 import Sim3, umeyama

from .conftest import same, similarities

POINTS = np.random.default_rng(0).normal(size=(40, 3)) * np.array([1.0, 0.6, 0.4]) + np.array([0.3, -0.2, 0.1])


@st.composite
def transforms(draw: st.DrawFn) -> Affine9:
    placed = draw(similarities())
    return Affine9(np.array([draw(st.floats(0.3, 3)) for _ in range(3)]), placed.rotation, placed.translation)


def error(transform: Affine9, source: np.ndarray, target: np.ndarray) -> float:
    return float(((transform.apply(source) - target) ** 2).sum())


@given(transforms())
def test_the_matrix_acts_as_the_transform(transform: Affine9) -> None:
    assert np.allclose(POINTS @ transform.as_matrix()[:3, :3].T + transform.as_matrix()[:3, 3], transform.apply(POINTS))


@given(transforms(), similarities(), similarities())
def test_similarities_act_one_after_the_other(transform: Affine9, first: Sim3, second: Sim3) -> None:
    assert np.allclose(transform.then(first).apply(POINTS), first.apply(transform.apply(POINTS)), atol=1e-8)
    assert np.allclose(transform.then(first).then(second).as_matrix(), transform.then(second @ first).as_matrix(), atol=1e-7)


@given(transforms())
def test_identity_is_neutral(transform: Affine9) -> None:
    assert same(transform.then(Sim3.identity()), transform)


@given(similarities())
def test_a_similarity_is_the_transform_of_equal_scales(similarity: Sim3) -> None:
    transform = Affine9.from_similarity(similarity)
    assert np.allclose(transform.apply(POINTS), similarity.apply(POINTS), atol=1e-9)
    assert np.allclose(transform.similarity().as_matrix(), similarity.as_matrix())


@given(transforms())
def test_its_similarity_changes_volume_as_much(transform: Affine9) -> None:
    similarity = transform.similarity()
    assert np.isclose(np.linalg.det(similarity.as_matrix()), np.linalg.det(transform.as_matrix()))
    assert np.allclose(similarity.apply(np.zeros(3)), transform.apply(np.zeros(3)))


@given(transforms())
def test_an_exact_transform_is_recovered(transform: Affine9) -> None:
    assert same(fit_affine9(POINTS, transform.apply(POINTS)), transform, 1e-6)


def test_known_answer_by_hand() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    stretched_then_quarter_turn = np.array([[5.0, 0, 0], [5, 2, 0], [2, 0, 0], [5, 0, 4]])  # scales 2, 3, 4; x → y, y → −x
    fit = fit_affine9(corners, stretched_then_quarter_turn)
    assert np.allclose(fit.scales, [2, 3, 4])
    assert np.allclose(fit.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.allclose(fit.translation, [5, 0, 0])


def test_zero_weight_ignores_an_outlier(moved: Sim3) -> None:
    truth = Affine9(np.array([1.2, 0.8, 1.5]), moved.rotation, moved.translation)
    target = truth.apply(POINTS)
    target[0] += 10
    weights = np.ones(len(POINTS))
    weights[0] = 0
    assert same(fit_affine9(POINTS, target, weights), truth)


def test_refinement_beats_the_closed_form_and_its_neighbours_on_noise(moved: Sim3) -> None:
    rng = np.random.default_rng(1)
    truth = Affine9(np.array([1.4, 0.7, 1.0]), moved.rotation, moved.translation)
    target = truth.apply(POINTS) + rng.normal(scale=0.1, size=POINTS.shape)
    fit = fit_affine9(POINTS, target)
    least = error(fit, POINTS, target)
    assert least < error(truth, POINTS, target)
    assert least < error(Affine9.from_similarity(umeyama(POINTS, target)), POINTS, target)
    for _ in range(50):
        step = rng.normal(scale=0.003, size=9)
        turned = fit.rotation @ Rotation.from_rotvec(step[3:6]).as_matrix()
        assert least <= error(Affine9(fit.scales + step[:3], turned, fit.translation + step[6:]), POINTS, target)


@pytest.mark.parametrize("axis", range(3))
def test_mirrored_points_are_refused_not_fitted(axis: int) -> None:
    with pytest.raises(NoPose, match="reflection"):
        fit_affine9(POINTS, POINTS * np.where(np.arange(3) == axis, -1.0, 1.0))


@pytest.mark.parametrize("side", ["source", "target"])
def test_points_in_one_plane_are_refused(side: str) -> None:
    flat = POINTS @ np.diag([1.0, 1, 0]) @ Rotation.from_euler("xy", [30, 40], degrees=True).as_matrix().T
    given = {"source": POINTS, "target": POINTS} | {side: flat}
    with pytest.raises(NoPose, match=f"the {side} points .* in one plane"):
        fit_affine9(**given)


@pytest.mark.parametrize("points", [np.outer(np.arange(6.0), [1, 2, 3]), np.ones((6, 3)), POINTS[:3]], ids=["line", "point", "three"])
def test_undetermined_points_are_refused(points: np.ndarray) -> None:
    with pytest.raises(NoPose):
        fit_affine9(points, points)


@pytest.mark.parametrize("scales", [[1, 0, 1], [1, -2, 1], [1, 1, np.nan]])
def test_scales_are_positive_numbers(scales: list[float]) -> None:
    with pytest.raises(InvalidInput, match="three positive"):
        Affine9(np.array(scales), np.eye(3), np.zeros(3))
