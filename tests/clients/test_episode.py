"""Episodes: what decisions are worth, and the whole loop against a service."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console

from clients.datasets.folders import Sequence, load_burst
from clients.errors import ClientError
from clients.pose_error import PoseError
from clients.robot import Observation, RobotClient
from clients.simulator.episode import Encounter, Episode, Verdict, judge, summarise
from clients.simulator.live import show, summary_rows
from clients.simulator.report import EpisodeRecord


def seen(outcome: Any) -> Observation:
    return Observation("id", outcome, None, None, None, None, None, None, (), 0.7, {}, {})


@pytest.mark.parametrize(
    ("outcome", "founder", "in_memory", "verdict"),
    [
        ("novel", None, False, Verdict.NEW),
        ("novel", None, True, Verdict.FALSE_NOVEL),
        ("known", "same", True, Verdict.RECOGNISED),
        ("known", "other", True, Verdict.FALSE_KNOWN),
        ("known", "other", False, Verdict.FALSE_KNOWN),
        ("known", None, False, Verdict.FALSE_KNOWN),
        ("uncertain", None, True, Verdict.UNDECIDED),
    ],
)
def test_decisions_are_judged_by_who_founded_the_category(
    samples: list[Sequence], outcome: str, founder: str | None, in_memory: bool, verdict: Verdict
) -> None:
    category = samples[0].category
    founders = {"same": samples[0], "other": next(each for each in samples if each.category != category), None: None}
    assert judge(seen(outcome), category, founders[founder], in_memory) is verdict


@pytest.fixture
def met(record: EpisodeRecord) -> list[Encounter]:
    """The encounters of `record`."""
    return list(record.encounters)


def test_an_episode_learns_recognises_and_scores(met: list[Encounter], samples: list[Sequence]) -> None:
    first, last = ([each for each in met if each.sequence is samples[index]] for index in (0, 1))
    assert [each.number for each in met] == [1, 2, 3]
    assert {each.verdict for each in met} == {Verdict.NEW, Verdict.RECOGNISED, Verdict.FALSE_NOVEL}
    again = next(each for each in first if each.verdict is Verdict.RECOGNISED)
    assert again.kind == samples[0].category
    assert again.error is not None
    assert again.error.rotation_deg < 10
    assert last[0].learnt is not None
    assert len(last[0].offsets_deg) == last[0].learnt.views == 10


def test_a_summary_counts_verdicts_and_good_poses(met: list[Encounter]) -> None:
    again = next(each for each in met if each.verdict is Verdict.RECOGNISED)
    assert again.error is not None
    wrong = replace(again, error=PoseError(40.0, 0.1, 0.0))
    without_pose = replace(again, error=None)
    summary = summarise([*met, wrong, without_pose, without_pose], total_s=60.0)
    assert (summary.objects, summary.kinds, summary.categories, summary.met_again) == (6, 1, 2, 5)
    assert (summary.correct_known, summary.false_novel, summary.false_known) == (4, 1, 0)
    assert summary.acc30 == pytest.approx(25)
    assert summary.median_deg == pytest.approx((again.error.rotation_deg + 40) / 2)


def test_an_episode_without_known_objects_has_no_accuracy(met: list[Encounter]) -> None:
    summary = summarise([each for each in met if each.verdict is not Verdict.RECOGNISED], total_s=1.0)
    assert summary.acc30 is None
    assert "Acc30" not in {what for what, _, _ in summary_rows(summary)}


def test_the_order_depends_on_the_seed_alone(robot: RobotClient, samples: list[Sequence]) -> None:
    orders = [[each.name for each in Episode(robot, samples, views=2, seed=seed).sequences] for seed in (3, 3, 4)]
    assert orders[0] == orders[1] != orders[2]


def test_a_used_memory_is_refused(robot: RobotClient, samples: list[Sequence]) -> None:
    burst = load_burst(samples[0], range(2))
    scan = robot.scan(burst)
    for view in burst.views:
        scan.add(view)
    scan.complete()
    with pytest.raises(ClientError, match="not empty"):
        Episode(robot, samples, views=2, seed=0)


def test_the_terminal_shows_wrong_decisions_in_words(met: list[Encounter]) -> None:
    output = io.StringIO()
    show(met, total=3, console=Console(file=output, width=160))
    assert "FALSE" in output.getvalue()
    assert "memory empty" in output.getvalue()
    assert met[0].sequence.name in output.getvalue()
