"""What more than one route answers with: things of the memory as JSON, each by its record or by its id."""

from __future__ import annotations

from collections.abc import Callable

from pydantic import BaseModel
from starlette.datastructures import QueryParams

from core.reference import MIN_VIEWS
from service.agent import Agent
from service.features import pose_details_from_arrays
from service.schemas.categories import Category
from service.schemas.goals import Goal
from service.schemas.observations import Debug, Observation
from service.schemas.scans import Scan
from service.state import MadeAnswer
from store import records


def scan_answer(agent: Agent, found: records.Scan) -> Scan:
    """With how far it is."""
    return Scan.of(found, agent.scanning.progress(found), views_required=MIN_VIEWS)


def observation_answer(agent: Agent, seen: records.Observation, *, debug: bool = False) -> Observation:
    """With the scan it asked for."""
    return Observation.of(
        seen, agent.names(), scan(agent, seen.scan_id) if seen.scan_id else None, _debug(agent, seen.id) if debug else None
    )


def scan(agent: Agent, scan_id: str) -> Scan:
    """Raises NotFound."""
    return scan_answer(agent, agent.memory.scans.get(scan_id))


def observation(agent: Agent, observation_id: str) -> Observation:
    """Raises NotFound."""
    return observation_answer(agent, agent.memory.observations.get(observation_id))


def category(agent: Agent, category_id: str) -> Category:
    """Raises NotFound."""
    return Category.of(agent.memory.categories.get(category_id))


def goal(agent: Agent, goal_id: str) -> Goal:
    """Raises NotFound."""
    return Goal.of(agent.memory.goals.get(goal_id))


def by_id(answer: Callable[[Agent, str], BaseModel]) -> MadeAnswer:
    """For an answer that no option changes."""

    def made(agent: Agent, made_id: str, query: QueryParams) -> BaseModel:
        return answer(agent, made_id)

    return made


def _debug(agent: Agent, observation_id: str) -> Debug | None:
    details = pose_details_from_arrays(agent.memory.observations.features(observation_id))
    return Debug(view_similarity=details.view_similarity.tolist(), pairs=list(details.pairs)) if details else None
