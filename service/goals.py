"""Goals: where an object of a category shall end, shown once, and the motion that takes a new one there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from core.errors import Conflict, InvalidInput, NoPose
from core.rearrange import Anchor, Motion, rearrange
from core.scan import infer_up, unit_up
from core.views import Burst, FloatArray
from service.events import Events
from store.memory import Memory
from store.records import Goal, Observation, Pose
from store.requests import unnoted

Source = Burst | str
"""A burst, or the id of an observation."""
Up = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Plan:
    """How an object gets to its goal."""

    goal: Goal
    observation: Observation
    """Of the object as it is now."""
    anchor: Anchor
    motion: Motion
    world_from_object: FloatArray
    """The object's frame once it is there, shape (4, 4)."""


class Rearranging:
    """The goals of one memory."""

    def __init__(self, observe: Callable[[Burst, str, str | None], Observation], memory: Memory, events: Events) -> None:
        """`observe(burst, category_id, frame)` finds the pose of an object whose category is known."""
        self._observe = observe
        self._memory = memory
        self._events = events

    def show(
        self, category_id: str, source: Source, *, name: str | None = None, anchor: Anchor = "center", frame: str | None = None
    ) -> Goal:
        """Keeps as a goal how an object of the category stands in a burst or an observation.

        Raises NotFound, NoPose where its pose is not found, Conflict for an observation of another category.
        """
        seen, pose = self._posed(category_id, source, frame)
        goal = self._memory.goals.create(
            category_id, name, pose.target_from_reference, frame=seen.frame, anchor=anchor, observation_id=seen.id
        )
        self._events.publish("goal_created", id=goal.id, category_id=category_id, name=name)
        return goal

    def plan(self, goal_id: str, source: Source, *, anchor: Anchor | None = None, up: Up | None = None, frame: str | None = None) -> Plan:
        """The motion that takes the object of a burst or an observation to a goal, both in one world frame.

        `up` is for the anchor `base`; told from the burst's cameras where left out. Raises as `show` does, InvalidInput where `up`
        cannot be told, and Conflict where the two world frames have different names.
        """
        goal = self._memory.goals.get(goal_id)
        seen, pose = self._posed(goal.category_id, source, frame)
        if goal.frame is not None and seen.frame is not None and goal.frame != seen.frame:
            raise Conflict(
                f"the goal is in the frame {goal.frame!r}, the object was seen in {seen.frame!r}; send cameras in the goal's frame"
            )
        reference = self._memory.categories.reference(goal.category_id)
        chosen = anchor or goal.anchor
        vertical = self._up(seen, up) if chosen == "base" else None
        motion = rearrange(
            reference.box, reference.symmetries, goal.target_from_reference, pose.target_from_reference, anchor=chosen, up=vertical
        )
        return Plan(goal, seen, chosen, motion, motion.goal_from_current @ pose.box.world_from_object)

    def delete(self, goal_id: str) -> None:
        """Raises NotFound."""
        self._memory.goals.delete(goal_id)
        self._events.publish("goal_deleted", id=goal_id)

    def _posed(self, category_id: str, source: Source, frame: str | None) -> tuple[Observation, Pose]:
        self._memory.categories.get(category_id)
        if isinstance(source, str):
            seen = self._memory.observations.get(source)
        else:
            with unnoted():  # a repeated request is answered with its goal, or does all of it again
                seen = self._observe(source, category_id, frame)
        if seen.category_id != category_id:
            raise Conflict(f"observation {seen.id!r} is not of category {category_id!r}; observe the object with category_id={category_id}")
        if seen.pose is None:
            raise NoPose(f"the object's pose was not found: {seen.pose_error}")
        return seen, seen.pose

    def _up(self, seen: Observation, up: Up | None) -> FloatArray:
        if up is not None:
            return unit_up(up)
        views = self._memory.observations.burst(seen.id).views
        told, source = infer_up([view.camera for view in views if view.camera is not None])
        if source == "assumed":
            raise InvalidInput("up", "is needed for the anchor base: the views look from one direction, which does not tell where up is")
        return told
