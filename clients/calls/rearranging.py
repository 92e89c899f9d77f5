"""Goals and plans: an object shown once where it belongs, and the motion that takes others there."""

from __future__ import annotations

from clients.answers.goals import Anchor, Goal, Plan
from clients.calls.call import Call, Direction, burst_or_id, given, nothing, reading, reading_list
from core.views import Burst


def set_goal(
    category_id: str, source: Burst | str, *, name: str | None = None, anchor: Anchor | None = None, frame: str | None = None
) -> Call[Goal]:
    """Keeps how an object of the category stands in a burst, or in an earlier observation by its id, as where others shall end.

    Args:
        anchor: which point goes exactly to its goal, the object's `center` or the middle of its `base`.
        frame: name of a burst's world frame.
    """
    params = given(name=name, anchor=anchor)
    return Call("POST", f"/v1/categories/{category_id}/goals", reading(Goal.from_json), params, burst_or_id(source, frame))


def goals(category_id: str) -> Call[list[Goal]]:
    """A category's goals, oldest first."""
    return Call("GET", f"/v1/categories/{category_id}/goals", reading_list("goals", Goal.from_json))


def goal(goal_id: str) -> Call[Goal]:
    """One goal."""
    return Call("GET", f"/v1/goals/{goal_id}", reading(Goal.from_json))


def forget_goal(goal_id: str) -> Call[None]:
    """Forgets a goal."""
    return Call("DELETE", f"/v1/goals/{goal_id}", nothing)


def plan(
    goal_id: str, source: Burst | str, *, anchor: Anchor | None = None, up: Direction | None = None, frame: str | None = None
) -> Call[Plan]:
    """The rigid motion that takes the object of a burst, or of an earlier observation by its id, to the goal, in one world frame.

    Args:
        anchor: as in `set_goal`; the goal's own where None.
        up: for the anchor `base`, away from the support; told from the cameras where None.
        frame: name of a burst's world frame.
    """
    params = given(anchor=anchor, up=None if up is None else list(up))
    return Call("POST", f"/v1/goals/{goal_id}/plan", reading(Plan.from_json), params, burst_or_id(source, frame))
