"""Every robust estimator recovers a similarity among wrong correspondences, and says when it cannot."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from core.errors import NoPose, Unavailable
from core.estimators import ESTIMATORS
from core.estimators.base import Estimator
from core.estimators.colmap import lo_ransac
from core.estimators.ransac import polish
from core.sim3 import Sim3


@pytest.fixture(params=sorted(ESTIMATORS))
def fitted_by(request: pytest.FixtureRequest) -> Estimator:
    return ESTIMATORS[request.param]


def problem(moved: Sim3, right: int, wrong: int, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    source = rng.uniform(-0.2, 0.2, (right + wrong, 3))
    target = moved.apply(source) + rng.normal(scale=noise, size=source.shape)
    target[right:] = rng.uniform(-0.5, 0.5, (wrong, 3)) + moved.translation
    return source, target


def test_a_similarity_is_recovered_among_sixty_percent_outliers(moved: Sim3, fitted_by: Estimator) -> None:
    source, target = problem(moved, 80, 120, noise=0.002)
    fit = fitted_by(source, target, 0.03, seed=0)
    assert np.allclose(fit.target_from_reference.as_matrix(), moved.as_matrix(), atol=0.01)
    assert fit.inlier[:80].all()
    assert fit.inlier[80:].mean() < 0.1
    assert fit.residual_m < 0.01


def test_a_fit_that_is_off_everywhere_to_reach_one_more_inlier_is_not_kept(moved: Sim3) -> None:
    source, target = problem(moved, 60, 0)
    target[0, 0] += 0.25
    bent = Sim3(moved.scale, moved.rotation, moved.translation + np.array([0.1, 0, 0]))
    fit = polish(source, target, bent, np.ones(60, dtype=bool), threshold_m=0.2)
    assert np.allclose(fit.target_from_reference.as_matrix(), moved.as_matrix(), atol=1e-6)
    assert fit.inlier.tolist() == [False] + [True] * 59


def test_the_same_seed_gives_the_same_answer(moved: Sim3, fitted_by: Estimator) -> None:
    source, target = problem(moved, 30, 60, noise=0.01)
    first, second = (fitted_by(source, target, 0.03, seed=5) for _ in range(2))
    assert np.array_equal(first.target_from_reference.as_matrix(), second.target_from_reference.as_matrix())


@pytest.mark.parametrize("count", [0, 3])
def test_too_few_correspondences_are_no_pose(count: int, fitted_by: Estimator) -> None:
    with pytest.raises(NoPose, match=f"{count} correspondences"):
        fitted_by(np.zeros((count, 3)), np.zeros((count, 3)), 0.1, seed=0)


def test_collinear_correspondences_are_no_pose(fitted_by: Estimator) -> None:
    line = np.outer(np.linspace(0, 1, 20), [1.0, 2, 3])
    with pytest.raises(NoPose, match="collinear|agree"):
        fitted_by(line, line, 0.1, seed=0)


def test_correspondences_that_do_not_agree_are_no_pose(fitted_by: Estimator) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(NoPose, match="agree"):
        fitted_by(rng.normal(size=(12, 3)), rng.normal(size=(12, 3)), 1e-4, seed=0)


def test_a_missing_extra_is_said_with_its_remedy(monkeypatch: pytest.MonkeyPatch, moved: Sim3) -> None:
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(Unavailable, match=r"pip install 'onelook\[colmap\]'"):
        lo_ransac(*problem(moved, 20, 0), 0.1, seed=0)
