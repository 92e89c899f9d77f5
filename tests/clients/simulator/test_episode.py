"""Episodes: what decisions are worth, and the whole loop against a service."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console

from clients.datasets.folders import Sequence, load_burst
from clients.errors import ClientError, NoObjectProblem
from clients.pose_error import PoseError
from clients.robot import RobotClient
from clients.simulator.encounter import Encounter, Founder, Verdict, judge
from clients.simulator.episode import Conduct, Episode, require_own_memory, shuffled
from clients.simulator.fleet import disagreements
from clients.simulator.live import show, summary_rows
from clients.simulator.pictures import fetch_pictures
from clients.simulator.replay import ReplaySubject
from clients.simulator.report import EpisodeRecord
from clients.simulator.summary import summarise
from core.views import Burst


@pytest.mark.parametrize(
    ("outcome", "founder", "in_memory", "verdict"),
    [
        ("novel", None, False, Verdict.NEW),
        ("novel", None, True, Verdict.FALSE_NOVEL),
        ("known", "cup", True, Verdict.RECOGNISED),
        ("known", "car", True, Verdict.FALSE_KNOWN),
        ("known", "car", False, Verdict.FALSE_KNOWN),
        ("known", None, False, Verdict.FALSE_KNOWN),
        ("uncertain", None, True, Verdict.UNDECIDED),
    ],
)
def test_decisions_are_judged_by_who_founded_the_category(outcome: str, founder: str | None, in_memory: bool, verdict: Verdict) -> None:
    who = None if founder is None else Founder(founder, f"{founder}/1", None)
    assert judge(outcome, "cup", who, in_memory) is verdict


@pytest.fixture
def met(record: EpisodeRecord) -> list[Encounter]:
    """The encounters of `record`."""
    return list(record.encounters)


def test_an_episode_learns_recognises_and_scores(met: list[Encounter], recordings: list[Sequence]) -> None:
    first, last = ([each for each in met if each.name == recordings[index].name] for index in (0, 1))
    assert [each.number for each in met] == [1, 2, 3]
    assert {each.verdict for each in met} == {Verdict.NEW, Verdict.RECOGNISED, Verdict.FALSE_NOVEL}
    again = next(each for each in first if each.verdict is Verdict.RECOGNISED)
    assert again.kind == recordings[0].category
    assert again.error is not None
    assert again.error.rotation_deg < 10
    assert last[0].learnt is not None
    assert last[0].learnt_views == len(last[0].offsets_deg) == 10
    assert last[0].view_faults == ()  # so none was taken again; test_scanning.py has those that are


def test_a_summary_counts_verdicts_and_good_poses(met: list[Encounter]) -> None:
    again = next(each for each in met if each.verdict is Verdict.RECOGNISED)
    assert again.error is not None
    wrong = replace(again, error=PoseError(40.0, 0.1, 0.0))
    without_pose = replace(again, error=None)
    summary = summarise([*met, wrong, without_pose, without_pose], total_s=60.0)
    assert (summary.objects, summary.kinds, summary.categories, summary.met_again) == (6, 1, 2, 5)
    assert summary.false_novel_rate == pytest.approx(20)
    assert (summary.correct_known, summary.false_novel, summary.false_known) == (4, 1, 0)
    assert summary.acc30 == pytest.approx(25)
    assert summary.median_deg == pytest.approx((again.error.rotation_deg + 40) / 2)


def test_an_episode_without_known_objects_has_no_accuracy(met: list[Encounter]) -> None:
    summary = summarise([each for each in met if each.verdict is not Verdict.RECOGNISED], total_s=1.0)
    assert summary.acc30 is None
    assert "Acc30" not in {what for what, _, _ in summary_rows(summary)}


def test_the_order_depends_on_the_seed_alone(recordings: list[Sequence]) -> None:
    subjects = [ReplaySubject(each) for each in recordings]
    orders = [[each.name for each in shuffled(subjects, seed)] for seed in (3, 3, 4)]
    assert orders[0] == orders[1] != orders[2]


def test_a_used_memory_is_refused_unless_the_episode_made_it(robot: RobotClient, recordings: list[Sequence], met: list[Encounter]) -> None:
    burst = load_burst(recordings[0], range(2))
    scan = robot.scan(burst)
    for view in burst.views:
        scan.add(view)
    category = scan.complete()
    with pytest.raises(ClientError, match="not empty"):
        require_own_memory(robot, set())
    require_own_memory(robot, {category.id})


def test_an_encounter_is_a_line_of_json_and_back(met: list[Encounter]) -> None:
    for each in met:
        assert Encounter.from_json(each.as_json()) == each


def test_a_resumed_episode_meets_the_rest_and_knows_who_founded_what(url: str, recordings: list[Sequence]) -> None:
    subjects = [ReplaySubject(recordings[0])] * 2
    conduct = Conduct(views=12)
    with RobotClient(url) as robot:
        (first,) = list(Episode(robot, subjects[:1], conduct))
        (second,) = list(Episode(robot, subjects, conduct, done=[Encounter.from_json(first.as_json())]))
    assert (second.number, second.verdict, second.kind) == (2, Verdict.RECOGNISED, recordings[0].category)
    assert second.error is not None


def test_what_is_not_seen_is_left_undecided_and_the_robot_goes_on(
    robot: RobotClient, recordings: list[Sequence], monkeypatch: pytest.MonkeyPatch
) -> None:
    observe, asked = robot.observe, []

    def blind_once(burst: Burst, **options: Any) -> Any:
        asked.append(burst)
        if len(asked) == 1:
            raise NoObjectProblem("views: no view shows an object that stands out", status=422)
        return observe(burst, **options)

    monkeypatch.setattr(robot, "observe", blind_once)
    first, second = Episode(robot, [ReplaySubject(each) for each in recordings[:2]], Conduct(views=6))
    assert (first.verdict, first.failure) == (Verdict.UNDECIDED, "views: no view shows an object that stands out")
    assert second.verdict is Verdict.NEW
    assert fetch_pictures(robot, first).rgb is None
    assert disagreements(robot, [first, second]) == []


def test_of_a_category_that_was_deleted_there_are_no_pictures(met: list[Encounter], robot: RobotClient) -> None:
    pictures = fetch_pictures(robot, replace(met[0], learnt="gone", learnt_views=2))
    assert (pictures.scanned, pictures.rgb) == (None, None)


def test_lost_views_never_arrive(robot: RobotClient, recordings: list[Sequence]) -> None:
    (met,) = list(Episode(robot, [ReplaySubject(recordings[0])], Conduct(views=12, lost_views=0.5)))
    assert 1 <= met.views < 12


def test_the_terminal_shows_wrong_decisions_in_words(met: list[Encounter]) -> None:
    output = io.StringIO()
    show(met, total=3, console=Console(file=output, width=160))
    assert "FALSE" in output.getvalue()
    assert "memory empty" in output.getvalue()
    assert f" {met[0].name.rpartition('/')[2]} " in output.getvalue()


@pytest.mark.parametrize("width", [80, 90, 120])
def test_a_row_is_one_whole_line_on_every_terminal(met: list[Encounter], width: int) -> None:
    output, name = io.StringIO(), "locomotive/locomotive_1"
    long = replace(met[0], number=15, name=name, category="locomotive", kind="locomotive", verdict=Verdict.FALSE_KNOWN)
    show([replace(long, similarity=-0.186, threshold=0.375)], total=1, console=Console(file=output, width=width))
    head, row = output.getvalue().rstrip().splitlines()
    assert {"object", "decision", "similarity", "rotation", "scan"} <= set(head.split())
    assert ("ms" in head) == (width > 80)
    assert row.startswith("  15 locomotive_1 ")
    assert "FALSE KNOWN → locomotive" in row
    assert "-0.186 ≤ 0.375" in row
