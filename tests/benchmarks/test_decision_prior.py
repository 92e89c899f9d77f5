"""The figures that ship, from tables made by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.decision_prior import write
from core.calibration import SHIPPED
from core.errors import InvalidInput
from core.evidence import Usual, cohort_level

LABELS = np.array([0, 0, 1, 1, 2])
MATCH = np.array(
    [
        [1.0, 0.6, 0.2, 0.1, 0.3],
        [0.6, 1.0, 0.1, 0.2, 0.2],
        [0.2, 0.1, 1.0, 0.5, 0.1],
        [0.1, 0.2, 0.5, 1.0, 0.2],
        [0.3, 0.2, 0.1, 0.2, 1.0],
    ]
)
AGREEMENT = np.where(LABELS[:, None] == LABELS, 0.3, MATCH / 10)


@pytest.fixture
def figures(tmp_path: Path) -> dict:
    return json.loads(write(tmp_path / "decision.json", "any", LABELS, MATCH, AGREEMENT).read_text())


def test_the_usual_match_is_that_with_the_founders_of_other_kinds(figures: dict) -> None:
    # Burst by burst, with the first of every other kind.
    with_others = [0.2, 0.3, 0.1, 0.2, 0.2, 0.1, 0.1, 0.2, 0.3, 0.1]
    assert figures["usual"] == pytest.approx({"mean": np.mean(with_others), "deviation": np.std(with_others)}, abs=1e-4)


def test_the_right_category_is_asked_with_the_others_for_its_cohort(figures: dict) -> None:
    usual = Usual(**figures["usual"])
    levels = [float(cohort_level(MATCH[[2, 4], burst], usual)) for burst in (0, 1)]
    assert figures["tokens"]["own"][0] == pytest.approx(0.6 - np.mean(levels), abs=1e-4)


def test_every_burst_gives_a_rival_and_those_with_another_of_their_kind_a_right_one(figures: dict) -> None:
    for kind in ("tokens", "verified"):
        assert (len(figures[kind]["rivals"]), len(figures[kind]["own"])) == (5, 4)
    assert figures["verified"]["own"][0] == pytest.approx(figures["tokens"]["own"][0] + figures["agreement_weight"] * 0.3, abs=1e-3)


def test_what_ships_has_the_fields_that_are_written(figures: dict) -> None:
    assert json.loads(SHIPPED.read_text()).keys() == figures.keys()


def test_bursts_that_no_pose_is_found_for_are_refused(tmp_path: Path) -> None:
    agreement = AGREEMENT.copy()
    agreement[0, 1] = np.nan
    with pytest.raises(InvalidInput, match="leave them out"):
        write(tmp_path / "decision.json", "any", LABELS, MATCH, agreement)
    assert not list(tmp_path.iterdir())
