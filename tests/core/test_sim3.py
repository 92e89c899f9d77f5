"""Sim(3) is a group that acts on points; its fit recovers what was applied."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from core.errors import InvalidInput, NoPose
from core.sim3 import Sim3, rotation_angle_deg, umeyama

from .conftest import same, similarities

POINTS = np.random.default_rng(0).normal(size=(6, 3))


@given(similarities())
def test_inverse_undoes(transform: Sim3) -> None:
    assert same(transform @ transform.inverse(), Sim3.identity())
    assert same(transform.inverse() @ transform, Sim3.identity())


@given(similarities(), similarities(), similarities())
def test_composition_is_associative(a: Sim3, b: Sim3, c: Sim3) -> None:
    assert np.allclose(((a @ b) @ c).apply(POINTS), (a @ (b @ c)).apply(POINTS), atol=1e-6)


@given(similarities(), similarities())
def test_composition_acts_as_one_after_the_other(a: Sim3, b: Sim3) -> None:
    assert np.allclose((a @ b).apply(POINTS), a.apply(b.apply(POINTS)), atol=1e-7)


@given(similarities())
def test_a_transform_comes_back_from_its_matrix(transform: Sim3) -> None:
    assert same(Sim3.from_matrix(transform.as_matrix()), transform)


def test_a_turn_about_a_point_leaves_it_where_it_is() -> None:
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    center = np.array([1.0, 2, 3])
    turn = Sim3.turn_about(center, quarter)
    assert turn.scale == 1
    assert np.allclose(turn.apply(center), center)
    assert np.allclose(turn.apply(center + [1, 0, 2]), center + [0, 1, 2])


def test_a_matrix_by_hand() -> None:
    rotation = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    matrix = Sim3(2.0, rotation, np.array([3.0, 4, 5])).as_matrix()
    assert matrix.tolist() == [[0, -2, 0, 3], [2, 0, 0, 4], [0, 0, 2, 5], [0, 0, 0, 1]]


def test_a_matrix_of_single_precision_is_gone_on_with_in_double() -> None:
    transform = Sim3.from_matrix(np.eye(4, dtype=np.float32))
    assert (transform.rotation.dtype, transform.translation.dtype) == (np.float64, np.float64)


@given(similarities())
def test_umeyama_recovers_an_exact_similarity(transform: Sim3) -> None:
    assert same(umeyama(POINTS, transform.apply(POINTS)), transform)


def test_known_answer_by_hand() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    quarter_turn_doubled = np.array([[3.0, 0, 0], [3, 2, 0], [1, 0, 0], [3, 0, 2]])
    fit = umeyama(corners, quarter_turn_doubled)
    assert np.isclose(fit.scale, 2)
    assert np.allclose(fit.translation, [3, 0, 0])
    assert np.allclose(fit.quaternion, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)])


def test_zero_weight_ignores_an_outlier(moved: Sim3) -> None:
    target = moved.apply(POINTS)
    target[0] += 10
    assert same(umeyama(POINTS, target, np.array([0.0, 1, 1, 1, 1, 1])), moved)


def test_mirrored_points_give_a_rotation_not_a_reflection() -> None:
    fit = umeyama(POINTS, POINTS * np.array([1, 1, -1]))
    assert np.isclose(np.linalg.det(fit.rotation), 1)


LINE = np.outer(np.arange(5.0), [1, 2, 3])


@pytest.mark.parametrize("source", [LINE, LINE + 1e-8 * POINTS[:5], np.ones((5, 3))], ids=["line", "nearly a line", "point"])
def test_undetermined_points_are_refused(source: np.ndarray) -> None:
    with pytest.raises(NoPose, match="^the correspondences lie on one line or point, so their rotation is not determined$"):
        umeyama(source, source)


def test_two_points_are_too_few() -> None:
    with pytest.raises(NoPose, match="^a similarity needs three correspondences, found 2$"):
        umeyama(POINTS[:2], POINTS[:2])


def test_three_points_are_enough(moved: Sim3) -> None:
    assert same(umeyama(POINTS[:3], moved.apply(POINTS[:3])), moved)


@pytest.mark.parametrize("size_m", [1e-4, 1e4])
def test_an_object_of_any_size_is_fitted(size_m: float, moved: Sim3) -> None:
    fit = umeyama(size_m * POINTS, moved.apply(size_m * POINTS))
    assert np.allclose(fit.rotation, moved.rotation, atol=1e-8)
    assert np.isclose(fit.scale, moved.scale)


@pytest.mark.parametrize("scale", [-1.0, 0.0, np.inf, np.nan])
def test_a_scale_that_is_not_positive_is_refused(scale: float) -> None:
    with pytest.raises(InvalidInput, match=f"^scale: expected a positive number, found {scale}$"):
        Sim3(scale, np.eye(3), np.zeros(3))


@pytest.mark.parametrize(("linear", "found"), [(np.diag([1.0, 1, -1]), "-1"), (np.diag([1.0, 1, 0]), "0")])
def test_a_matrix_that_mirrors_or_flattens_is_refused(linear: np.ndarray, found: str) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    with pytest.raises(InvalidInput, match=f"^matrix: determinant is {found}; a similarity has a positive one$"):
        Sim3.from_matrix(matrix)


def test_a_matrix_that_stretches_is_refused() -> None:
    with pytest.raises(InvalidInput, match="^matrix: its 3×3 block is not a rotation times one scale$"):
        Sim3.from_matrix(np.diag([1.01, 1, 1, 1]))


def test_a_matrix_of_a_file_s_precision_is_taken() -> None:
    turned = np.round(Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix(), 4)
    assert Sim3.from_matrix(np.block([[turned, np.zeros((3, 1))], [np.eye(4)[3]]])).scale == pytest.approx(1, abs=1e-4)


def test_the_angle_between_rotations_is_in_degrees() -> None:
    turned = Rotation.from_euler("z", [[40], [170]], degrees=True).as_matrix()
    assert np.allclose(rotation_angle_deg(np.eye(3), turned), [40, 170])


@pytest.mark.parametrize("angle_deg", [0, 180])
def test_rounding_leaves_an_angle_a_number(angle_deg: int) -> None:
    rounded = (1 + 1e-9) * Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    assert rotation_angle_deg(np.eye(3), rounded) == angle_deg


@given(similarities())
def test_the_quaternion_is_of_the_rotation(transform: Sim3) -> None:
    quaternion = transform.quaternion
    assert quaternion[0] >= 0
    np.testing.assert_allclose(Rotation.from_quat(quaternion, scalar_first=True).as_matrix(), transform.rotation, atol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_have_their_axis_as_quaternion(axis: int) -> None:
    half_turn = -np.eye(3)
    half_turn[axis, axis] = 1
    np.testing.assert_allclose(Sim3(1.0, half_turn, np.zeros(3)).quaternion, [0, *np.eye(3)[axis]], atol=1e-12)
