"""Goals and plans: an object shown once where it belongs, and the motion that takes others there."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query

from service.deps import AgentDep, SentDep, WorkDep
from service.exchange import MemoryRoute
from service.routes.answers import by_id, goal
from service.schemas.bursts import burst_or_seen
from service.schemas.goals import Goal, GoalList, GoalQuery, Plan, PlanQuery
from service.schemas.problem import problems

router = APIRouter(tags=["goals"], route_class=MemoryRoute)
BODY: dict[str, Any] = burst_or_seen("an observation with a pose, of the goal's category")


@router.post(
    "/v1/categories/{category_id}/goals",
    status_code=201,
    responses=problems(404, 409, 413, 415, 422, 503),
    openapi_extra={"requestBody": BODY},
)
async def create_goal(category_id: str, read: SentDep, query: Annotated[GoalQuery, Query()], agent: AgentDep, work: WorkDep) -> Goal:
    """Keeps how an object of the category stands now, in a burst or in an earlier observation, as where others shall end."""

    def show() -> Goal:
        sent = read()
        shown = agent.rearranging.show(category_id, sent.source, name=query.name, anchor=query.anchor, frame=sent.frame)
        return Goal.of(shown)

    return await work.run(show)


@router.get("/v1/categories/{category_id}/goals", responses=problems(404, 422))
def list_goals(category_id: str, agent: AgentDep) -> GoalList:
    """A category's goals, oldest first."""
    return GoalList(goals=[Goal.of(each) for each in agent.memory.goals.of(category_id)])


@router.get("/v1/goals/{goal_id}", responses=problems(404, 422))
def get_goal(goal_id: str, agent: AgentDep) -> Goal:
    """One goal."""
    return goal(agent, goal_id)


@router.delete("/v1/goals/{goal_id}", status_code=204, responses=problems(404, 422, 503))
def delete_goal(goal_id: str, agent: AgentDep) -> None:
    """Forgets a goal."""
    agent.rearranging.delete(goal_id)


@router.post("/v1/goals/{goal_id}/plan", responses=problems(404, 409, 413, 415, 422, 503), openapi_extra={"requestBody": BODY})
async def plan(goal_id: str, read: SentDep, query: Annotated[PlanQuery, Query()], agent: AgentDep, work: WorkDep) -> Plan:
    """The rigid motion that takes the object of a burst, or of an earlier observation, to the goal; both in one world frame."""
    up = query.options_up()

    def planned() -> Plan:
        sent = read()
        return Plan.of(agent.rearranging.plan(goal_id, sent.source, anchor=query.anchor, up=up, frame=sent.frame))

    return await work.run(planned)


MADE = {"/v1/categories/{category_id}/goals": by_id(goal)}
"""What a repeated request is answered with where its first answer was lost."""
