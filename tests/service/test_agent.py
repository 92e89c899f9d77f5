"""The agent alone, without HTTP."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from core.errors import Conflict, InvalidInput, TooFewViews
from service.agent import Agent, AgentConfig, ObserveOptions
from service.compute import in_this_process
from store.memory import Memory

CONFIG = AgentConfig("pooled_best_view", 0.7, variant="ucd")


@pytest.fixture
def agent(tmp_path, backbone):
    """An agent with an empty memory."""
    with Memory.open(tmp_path / "memory") as memory:
        yield Agent(in_this_process(backbone), memory, CONFIG)


def test_a_novel_object_is_known_once_it_is_scanned(agent, look):
    seen = agent.observe(look())
    assert (seen.outcome, seen.pose) == ("novel", None)
    agent.scanning.add(seen.scan_id, look())
    category = agent.scanning.complete(seen.scan_id, "ball")
    again = agent.observe(look())
    assert (again.outcome, again.category_id) == ("known", category.id)
    assert np.allclose(again.pose.target_from_reference.as_matrix(), np.eye(4), atol=0.01)


def test_an_answer_is_the_same_after_reopening(tmp_path, backbone, look):
    asked = look("bright", views=3), ObserveOptions(learn=False)
    with Memory.open(tmp_path / "memory") as memory:
        agent = Agent(in_this_process(backbone), memory, CONFIG)
        scan = agent.scanning.begin(look())
        agent.scanning.add(scan.id, look())
        agent.scanning.complete(scan.id)
        before = agent.observe(*asked)
    with Memory.open(tmp_path / "memory") as memory:
        after = Agent(in_this_process(backbone), memory, CONFIG).observe(*asked)
    assert after.decision.similarities == before.decision.similarities
    assert np.array_equal(after.pose.target_from_reference.as_matrix(), before.pose.target_from_reference.as_matrix())


def test_an_observation_s_tokens_are_kept_for_a_later_scan(agent, look):
    seen = agent.observe(look())
    kept = agent.encoded(seen.id)
    fresh = agent.encoder.encode(look())
    assert np.allclose(kept.views[3].descriptors, fresh.views[3].descriptors, atol=1e-3)
    assert np.array_equal(kept.cloud_m, fresh.cloud_m)


def test_an_unknown_variant_is_refused_before_anything_is_computed(agent, look):
    with pytest.raises(InvalidInput, match="variant"):
        agent.observe(look(), ObserveOptions(variant="nonsense"))
    assert agent.memory.observations.latest(1) == []


def test_one_view_makes_no_category(agent, look):
    scan = agent.scanning.begin(look())
    agent.scanning.add(scan.id, look().select([0]))
    with pytest.raises(TooFewViews, match="send 1 more"):
        agent.scanning.complete(scan.id)


def test_two_that_complete_one_scan_at_once_make_one_category(agent, look):
    scan = agent.scanning.begin(look())
    agent.scanning.add(scan.id, look())
    outcomes = []

    def complete():
        try:
            outcomes.append(agent.scanning.complete(scan.id).id)
        except Conflict:
            outcomes.append("conflict")

    threads = [threading.Thread(target=complete) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    made = [category.id for category in agent.memory.categories.all()]
    assert len(made) == 1
    assert sorted(outcomes) == sorted([made[0], "conflict"])
