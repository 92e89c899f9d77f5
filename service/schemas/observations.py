"""Observations as JSON.

Letters: M reference views, N views of the burst.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.schemas import scans
from service.schemas.geometry import Box, Matrix4, Similarity
from store import records


class ObserveQuery(BaseModel):
    """Query options of an observation."""

    model_config = ConfigDict(extra="forbid")

    category_id: str | None = Field(None, description="Takes the object for one of this category and skips the decision.")
    threshold: float | None = Field(None, allow_inf_nan=False, description="Least similarity of a known object, for this request.")
    views_used: int | None = Field(None, ge=1, description="Uses only this many of the burst's views, the first ones.")
    learn: bool = Field(
        True,
        description="A known object's burst joins its category, for later decisions; false leaves what is known as it is.",
    )
    variant: str | None = Field(None, description="Variant of the pose pipeline, for this request.")
    seed: int = Field(0, ge=0, lt=2**31, description="Of the random choices in the pose pipeline; the same seed gives the same pose.")
    include: list[Literal["debug"]] = Field([], description="`debug` adds what the pose was computed from.", examples=[["debug"]])


class CategorySimilarity(BaseModel):
    """How similar a burst is to one category."""

    category_id: str
    name: str | None = Field(description="Null where it has none, or where the category was deleted since.")
    similarity: float = Field(description="In the score's own unit; larger is more similar.", examples=[0.83])


class Alternative(BaseModel):
    """Another transform that was considered."""

    target_from_reference: Similarity
    score: float = Field(description="Larger is better; to be compared with the pose's `score`.")


class Pose(BaseModel):
    """Where the object is and how it is turned."""

    target_from_reference: Similarity = Field(
        description="From the world frame of the category's reference scan to the world frame of this burst, metres both."
    )
    world_from_object: Matrix4 = Field(
        description="Rigid: the object frame (centre and axes of its box) in the burst's world frame, metres."
    )
    box: Box
    inliers: int = Field(description="Correspondences that agree with the transform.", examples=[118])
    correspondences: int = Field(description="Correspondences it was fitted to.", examples=[250])
    best_view: int = Field(description="Which of the burst's views has the most inliers, from 0; its pictures tell most.", examples=[2])
    residual_m: float = Field(description="Root mean square distance of the inliers after the transform, metres.", examples=[0.004])
    score: float | None = Field(description="How well both objects agree after the transform, in [0, 1], where the variant computes it.")
    confidence: float | None = Field(description="Probability that the rotation is within 30°, where the variant estimates one.")
    alternatives: list[Alternative] = Field(description="Other transforms that were considered, best first.")

    @staticmethod
    def of(pose: records.Pose) -> Pose:
        """From the memory's record."""
        return Pose(
            target_from_reference=Similarity.of(pose.target_from_reference),
            world_from_object=pose.box.world_from_object.tolist(),
            box=Box.of(pose.box),
            inliers=pose.inliers,
            correspondences=pose.correspondences,
            best_view=pose.best_view,
            residual_m=pose.residual_m,
            score=pose.score,
            confidence=pose.confidence,
            alternatives=[
                Alternative(target_from_reference=Similarity.of(transform), score=score) for transform, score in pose.alternatives
            ],
        )


class Debug(BaseModel):
    """What a pose was computed from."""

    view_similarity: list[list[float]] = Field(description="Similarity of reference view m and burst view n, shape (M, N).")
    pairs: list[tuple[int, int]] = Field(description="(reference view, burst view) pairs whose correspondences were used.")


class Observation(BaseModel):
    """What was seen."""

    id: str = Field(description="Names it in /v1/observations/{id}.", examples=["9f1c1b8a4b0c4a0fb0a5c0b7f5a0d6c3"])
    created_at: str = Field(description="ISO 8601, UTC.", examples=["2026-01-31T12:00:00.000+00:00"])
    frame: str | None = Field(description="Name of the burst's world frame, as it was sent.", examples=["map"])
    outcome: records.Outcome = Field(
        description="`known`: recognised; `novel`: of no category so far; `uncertain`: more views would settle it."
    )
    views: int = Field(description="Views the answer rests on.", examples=[5])
    category_id: str | None = Field(description="The category it was recognised as; null where it is none, or was deleted since.")
    name: str | None = Field(description="That category's name.")
    score: str | None = Field(description="The score behind the decision; null where the request named the category.")
    threshold: float | None = Field(description="Least similarity of a known object in this decision.")
    similarities: list[CategorySimilarity] = Field(description="Every category compared with, most similar first.")
    pose: Pose | None = Field(description="Of a known object.")
    pose_error: str | None = Field(description="Why a known object has no pose.")
    scan: scans.Scan | None = Field(description="Of a novel object: the views to take so that it becomes a category.")
    scan_error: str | None = Field(description="Why a novel object has no scan.")
    timings_ms: dict[str, float] = Field(description="Milliseconds of each stage, and their `total`.")
    debug: Debug | None = Field(None, description="Where `include=debug` asked for it.")

    @staticmethod
    def of(
        observation: records.Observation, names: Mapping[str, str | None], scan: scans.Scan | None, debug: Debug | None = None
    ) -> Observation:
        """From the memory's record; `names` are the categories' by id."""
        decision = observation.decision
        similarities: list[dict[str, Any]] = [
            {"category_id": category_id, "name": names.get(category_id), "similarity": similarity}
            for category_id, similarity in (decision.similarities if decision else ())
        ]
        return Observation(
            id=observation.id,
            created_at=observation.created_at,
            frame=observation.frame,
            outcome=observation.outcome,
            views=observation.views,
            category_id=observation.category_id,
            name=names.get(observation.category_id) if observation.category_id else None,
            score=decision.score if decision else None,
            threshold=decision.threshold if decision else None,
            similarities=[CategorySimilarity(**each) for each in similarities],
            pose=Pose.of(observation.pose) if observation.pose else None,
            pose_error=observation.pose_error,
            scan=scan,
            scan_error=observation.scan_error,
            timings_ms=observation.timings_ms,
            debug=debug,
        )


class ObservationList(BaseModel):
    """The latest observations, newest first."""

    observations: list[Observation]
