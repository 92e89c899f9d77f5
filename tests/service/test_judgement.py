"""Decisions by evidence, with a memory behind them."""

from __future__ import annotations

import pytest

from service.agent import Agent, AgentConfig, ObserveOptions
from service.compute import in_this_process
from store.memory import Memory


@pytest.fixture
def agent(tmp_path, backbone, look):
    """An agent that knows one kind of object."""
    with Memory.open(tmp_path / "memory") as memory:
        made = Agent(in_this_process(backbone), memory, AgentConfig("best"))
        scan = made.scanning.begin(look())
        made.scanning.add(scan.id, look())
        made.scanning.complete(scan.id)
        yield made


def test_poses_verify_and_the_winner_s_is_the_answer_s(agent, look):
    seen = agent.observe(look(), ObserveOptions(learn=False))
    assert (seen.outcome, seen.decision.verified) == ("known", True)
    assert seen.decision.similarity > seen.decision.threshold > seen.decision.uncertain_above
    assert seen.pose is not None
    timings = dict(seen.timings_ms)
    assert "load" not in timings  # the pose came with the decision
    assert timings.pop("total") * 1.001 >= sum(timings.values())


def test_learning_not_asked_for_leaves_no_trace(agent, look):
    (category,) = agent.memory.categories.all()
    before = len(agent.memory.instances.of(category.id))
    seen = agent.observe(look(), ObserveOptions(learn=False))
    assert len(agent.memory.instances.of(category.id)) == before
    assert [decision.rival for decision in agent.memory.observations.decisions(10)] == [None]
    assert agent.observe(look(), ObserveOptions(learn=False)).decision.threshold == seen.decision.threshold


RATE = 0.4
"""At which even the other kind of object is known; a tenth of it is still stricter."""


def test_a_known_burst_above_the_stricter_level_joins(agent, look):
    seen = agent.observe(look(), ObserveOptions(false_known_rate=RATE))
    assert (seen.outcome, seen.decision.similarity > seen.decision.learn_above) == ("known", True)
    assert [each.source_id for each in agent.memory.instances.of(seen.category_id)][1:] == [seen.id]


def test_a_known_burst_below_the_stricter_level_does_not_join(agent, look):
    seen = agent.observe(look("dark", views=2), ObserveOptions(false_known_rate=RATE))
    assert (seen.outcome, seen.decision.similarity < seen.decision.learn_above) == ("known", True)
    assert len(agent.memory.instances.of(seen.category_id)) == 1


def test_an_uncertain_object_gets_viewpoints_and_no_category(agent, look):
    sure = agent.observe(look("dark", views=2), ObserveOptions(learn=False)).decision
    rates = [10.0**-power for power in range(1, 12)]
    for rate in rates:
        seen = agent.observe(look("dark", views=2), ObserveOptions(learn=False, false_known_rate=rate))
        if seen.outcome == "uncertain":
            break
    else:
        pytest.fail(f"no rate makes {sure.similarity} uncertain")
    assert (seen.category_id, seen.pose, seen.scan_id) == (None, None, None)
    looked = agent.observe(look("dark", views=2), ObserveOptions(learn=False, false_known_rate=rate, looks=1))
    assert seen.decision.threshold == looked.decision.threshold
    assert seen.decision.uncertain_above < looked.decision.uncertain_above <= looked.decision.threshold
    assert (looked.outcome, looked.decision.probability < 0.5) == ("novel", True)  # what is looked at and more probably wrong is novel
    assert seen.viewpoints.shape[1:] == (4, 4)
    assert agent.memory.observations.get(seen.id).viewpoints.shape == seen.viewpoints.shape
