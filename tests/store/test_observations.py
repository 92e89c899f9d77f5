"""Observations come back as they were answered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.boxes import OrientedBox
from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.grounds import Grounds
from core.novelty import Decision
from core.pose_estimate import Alternative
from core.quality import ViewFault
from core.reference import Reference
from core.scan import ScanRequest
from core.sim3 import Sim3
from core.views import Burst
from store.memory import Memory
from store.observations import Answer
from store.records import Category, Pose

FEATURES = {"a": np.arange(3)}
NOVEL = Answer("novel", None, "map", Decision("novel", "paper_mean", 0.4, (("x", 0.1),)), None, None, None, {"total": 12.5})


def known(category_id: str) -> Answer:
    """An answer with everything a pose has."""
    turn = Sim3(0.7, Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix(), np.array([1.0, 2, 3]))
    pose = Pose(
        turn, OrientedBox(np.eye(4), np.ones(3)), 10, 20, 3, 0.01, 0.7, None, (Alternative(turn, 0.5, 0.1),), ((1.0, 2, 3, 4), None)
    )
    return replace(NOVEL, outcome="known", category_id=category_id, pose=pose)


def test_a_decision_comes_back(memory: Memory, burst: Burst) -> None:
    seen = memory.observations.create(NOVEL, burst, FEATURES)
    assert vars(seen.decision) == vars(NOVEL.decision)
    assert (seen.outcome, seen.frame, seen.views, seen.timings_ms) == ("novel", "map", 3, {"total": 12.5})


def test_a_corrected_decision_tells_what_the_wrong_categories_reached(
    memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    right, wrong = (memory.categories.create(reference, burst, encoded).id for _ in range(2))
    decision = Decision("uncertain", "best", 0.4, ((right, 0.3), (wrong, 0.2)))
    seen = memory.observations.create(replace(NOVEL, decision=decision), burst, FEATURES)
    assert [each.rival for each in memory.observations.decisions(5)] == [None]
    memory.corrections.to_category(seen.id, right, encoded)
    assert [each.rival for each in memory.observations.decisions(5)] == [0.2]


def test_a_pose_comes_back_exactly(memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst) -> None:
    answer = known(memory.categories.create(reference, burst, encoded).id)
    pose = memory.observations.create(answer, burst, FEATURES).pose
    assert np.array_equal(pose.target_from_reference.as_matrix(), answer.pose.target_from_reference.as_matrix())
    (alternative,) = pose.alternatives
    assert np.array_equal(alternative.target_from_reference.as_matrix(), answer.pose.target_from_reference.as_matrix())
    assert (alternative.score, alternative.confidence) == (0.5, 0.1)
    assert pose.boxes_px == ((1, 2, 3, 4), None)
    assert (pose.inliers, pose.correspondences, pose.best_view) == (10, 20, 3)
    assert (pose.residual_m, pose.score, pose.confidence) == (0.01, 0.7, None)


def test_views_and_features_come_back(memory: Memory, burst: Burst) -> None:
    seen = memory.observations.create(NOVEL, burst, FEATURES)
    assert np.array_equal(memory.observations.view(seen.id, 2).rgb, burst.views[2].rgb)
    assert np.array_equal(memory.observations.features(seen.id)["a"], FEATURES["a"])


def test_a_view_it_does_not_have_is_refused(memory: Memory, burst: Burst) -> None:
    seen = memory.observations.create(NOVEL, burst, FEATURES)
    with pytest.raises(NotFound, match="views 0 to 2"):
        memory.observations.view(seen.id, 3)


def test_its_scan_begins_in_the_same_step(memory: Memory, burst: Burst, request_for_views: ScanRequest) -> None:
    seen = memory.observations.create(NOVEL, burst, FEATURES, request_for_views)
    assert memory.scans.get(seen.scan_id).observation_id == seen.id


def test_the_latest_come_first(memory: Memory, burst: Burst) -> None:
    ids = [memory.observations.create(NOVEL, burst, FEATURES).id for _ in range(3)]
    assert [seen.id for seen in memory.observations.latest(2)] == [ids[2], ids[1]]


def test_only_those_asked_for_are_listed(memory: Memory, category: Category, burst: Burst) -> None:
    novel, seen, again = (
        memory.observations.create(answer, burst, FEATURES).id for answer in (NOVEL, known(category.id), known(category.id))
    )
    assert [each.id for each in memory.observations.latest(9, before=again)] == [seen, novel]
    assert [each.id for each in memory.observations.latest(9, category_id=category.id)] == [again, seen]
    assert [each.id for each in memory.observations.latest(9, outcome="novel")] == [novel]
    assert [each.id for each in memory.observations.latest(9, before=again, category_id=category.id, outcome="known")] == [seen]
    with pytest.raises(NotFound):
        memory.observations.latest(9, before="nope")


def test_all_its_views_come_back_as_one_burst(memory: Memory, burst: Burst) -> None:
    found = memory.observations.burst(memory.observations.create(NOVEL, burst, FEATURES).id)
    assert [np.array_equal(mine.rgb, theirs.rgb) for mine, theirs in zip(found.views, burst.views, strict=True)] == [True] * 3


def test_where_to_look_next_and_what_it_rests_on_come_back(memory: Memory, burst: Burst) -> None:
    told = Grounds(3, 2, 1, 40.0, ((ViewFault("blur", "it is blurred"),), (), ()))
    poses = np.stack([np.eye(4), 2 * np.eye(4)])
    seen = memory.observations.create(replace(NOVEL, grounds=told, viewpoints=poses), burst, FEATURES)
    assert seen.grounds == told
    assert np.array_equal(seen.viewpoints, poses)


def test_deleting_its_category_keeps_the_observation(memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst) -> None:
    category = memory.categories.create(reference, burst, encoded)
    seen = memory.observations.create(known(category.id), burst, FEATURES)
    memory.categories.delete(category.id)
    assert memory.observations.get(seen.id).category_id is None


def test_a_category_deleted_meanwhile_is_told(memory: Memory, burst: Burst) -> None:
    with pytest.raises(Conflict, match="deleted meanwhile"):
        memory.observations.create(known("gone"), burst, FEATURES)
    assert memory.observations.latest(10) == []
