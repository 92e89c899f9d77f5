"""Goals and plans as JSON."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from core.rearrange import Anchor
from service import goals
from service.schemas.fields import CreatedAt
from service.schemas.geometry import Direction, Matrix4, Rigid, Similarity, as_up
from store import records
from store.records import LONGEST_NAME

ANCHOR = (
    "Which point goes exactly to its goal: the object's `center`, or the middle of its `base`, so that a smaller one stands on the same "
    "support."
)
GoalName = Field(None, min_length=1, max_length=LONGEST_NAME, description="What people call it.", examples=["on the shelf"])


class GoalQuery(BaseModel):
    """Query options of a new goal."""

    model_config = ConfigDict(extra="forbid")

    name: str | None = GoalName
    anchor: Anchor = Field("center", description=ANCHOR)


class PlanQuery(BaseModel):
    """Query options of a plan."""

    model_config = ConfigDict(extra="forbid")

    anchor: Anchor | None = Field(None, description=f"{ANCHOR} The goal's own where left out.")
    up: Direction | None = Field(
        None, description="For the anchor `base`: away from the support, `up=0&up=0&up=1`; told from the burst's cameras where left out."
    )

    def options_up(self) -> tuple[float, float, float] | None:
        """`up` as the agent has it."""
        return as_up(self.up)


class Goal(BaseModel):
    """Where an object of a category shall end."""

    id: str = Field(examples=["b1a4b1f8f4d94ab6a5a9cf1d5a0c2d5f"])
    category_id: str
    created_at: CreatedAt
    name: str | None = GoalName
    anchor: Anchor = Field(description=ANCHOR)
    frame: str | None = Field(description="Name of the world frame that the goal is in.", examples=["map"])
    target_from_reference: Similarity = Field(description="From the world frame of the reference scan to the goal's, metres both.")
    observation_id: str | None = Field(description="The observation that it was taken from, while that is kept.")

    @staticmethod
    def of(goal: records.Goal) -> Goal:
        """From the memory's record."""
        return Goal(
            id=goal.id,
            category_id=goal.category_id,
            created_at=goal.created_at,
            name=goal.name,
            anchor=goal.anchor,
            frame=goal.frame,
            target_from_reference=Similarity.of(goal.target_from_reference),
            observation_id=goal.observation_id,
        )


class GoalList(BaseModel):
    """The goals of a category, oldest first."""

    goals: list[Goal]


class Plan(BaseModel):
    """How an object gets to its goal."""

    goal: Goal
    observation_id: str = Field(description="Of the object as it is now; its pictures show what the plan rests on.")
    anchor: Anchor = Field(description=ANCHOR)
    goal_from_current: Rigid = Field(
        description="The motion, within the world frame: where a point of the object is now to where it shall be. A gripper that holds the "
        "object goes from world_from_gripper to goal_from_current · world_from_gripper."
    )
    angle_deg: float = Field(description="That the object turns.", examples=[87.0])
    distance_m: float = Field(description="That the anchor moves.", examples=[0.4])
    symmetric: bool = Field(description="Whether it ends turned by one of its symmetries, since that is less to turn.")
    world_from_object: Matrix4 = Field(description="The object frame once it is there, metres.")

    @staticmethod
    def of(plan: goals.Plan) -> Plan:
        """From the agent's answer."""
        return Plan(
            goal=Goal.of(plan.goal),
            observation_id=plan.observation.id,
            anchor=plan.anchor,
            goal_from_current=Rigid.of(plan.motion.goal_from_current),
            angle_deg=plan.motion.angle_deg,
            distance_m=plan.motion.distance_m,
            symmetric=plan.motion.symmetric,
            world_from_object=plan.world_from_object.tolist(),
        )
