"""Observations as JSON.

Letters: M reference views, N views of the burst.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from core.calibration import LARGEST_RATE
from core.novelty import Outcome
from core.pose import PoseOptions
from core.sim3 import Sim3
from core.views import FloatArray
from service.agent import ObserveOptions
from service.schemas import scans
from service.schemas.fields import CreatedAt
from service.schemas.geometry import Box, Direction, Matrix4, Quaternion, Similarity, Stretch, as_up
from service.schemas.quality import Grounds
from service.settings import SMALLEST_RATE
from store import records
from store.records import LONGEST_NAME

PixelBox = Annotated[list[float], Field(min_length=4, max_length=4)]


def _number(value: object) -> object:
    """A query has text only, which a literal number is not made of."""
    return int(value) if isinstance(value, str) and value.isdecimal() else value


class ObserveQuery(BaseModel):
    """Query options of an observation."""

    model_config = ConfigDict(extra="forbid")

    category_id: str | None = Field(None, description="Takes the object for one of this category and skips the decision.")
    threshold: float | None = Field(None, allow_inf_nan=False, description="Least similarity of a known object, for this request.")
    false_known_rate: float | None = Field(
        None,
        ge=SMALLEST_RATE,
        le=LARGEST_RATE,
        description="Of objects of no known category, the share that may be called known, for this request.",
    )
    looks: int = Field(
        0,
        ge=0,
        le=100,
        description="Views in the burst that were taken since the object was uncertain; with each there is less room for doubt.",
    )
    views_used: int | None = Field(None, ge=1, description="Uses only this many of the burst's views, the first ones.")
    learn: bool = Field(
        True,
        description="A known object's burst joins its category where the evidence is strong; false leaves what is known as it is.",
    )
    up: Direction | None = Field(
        None, description="For the scan of a novel object: away from the support, `up=0&up=0&up=1`; told from the cameras where left out."
    )
    alternatives: int | None = Field(None, ge=0, le=10, description="Most other transforms to be given; of variant `best`.")
    variant: str | None = Field(None, description="Variant of the pose pipeline, for this request.")
    dof: Annotated[Literal[7, 9] | None, BeforeValidator(_number)] = Field(
        None, description="9 gives each axis of the object a scale of its own; 7 where left out."
    )
    dims: int | None = Field(None, ge=1, le=4096, description="Principal components of a descriptor that are compared.")
    method: str | None = Field(None, description="How correspondences are found.")
    consensus_deg: float | None = Field(None, gt=0, le=180, description="Angle within which view pairs agree, of variants with consensus.")
    inlier_ratio: float | None = Field(None, gt=0, le=1, description="Inlier threshold as a share of the object's diameter.")
    estimator: str | None = Field(None, description="What fits a transform to correspondences, of variants that do.")
    seed: int = Field(0, ge=0, lt=2**31, description="Of the random choices in the pose pipeline; the same seed gives the same pose.")

    def options(self) -> ObserveOptions:
        """As the agent has them."""
        return ObserveOptions(
            category_id=self.category_id,
            threshold=self.threshold,
            false_known_rate=self.false_known_rate,
            looks=self.looks,
            variant=self.variant,
            pose=PoseOptions(**{each.name: getattr(self, each.name) for each in fields(PoseOptions)}),
            alternatives=self.alternatives,
            learn=self.learn,
            up=as_up(self.up),
            seed=self.seed,
        )


class AnswerQuery(BaseModel):
    """How an observation is answered."""

    model_config = ConfigDict(extra="forbid")

    include: list[Literal["debug"]] = Field(
        [], max_length=1, description="`debug` adds what the pose was computed from.", examples=[["debug"]]
    )
    format: Literal["onelook", "vision_msgs"] = Field(
        "onelook", description="`vision_msgs` answers in the shape of ROS 2 vision_msgs/msg/Detection3DArray instead."
    )


class NewObservationQuery(ObserveQuery, AnswerQuery):
    """Both."""


class CategorySimilarity(BaseModel):
    """How similar a burst is to one category."""

    category_id: str
    name: str | None = Field(description="Null where it has none, or where the category was deleted since.")
    similarity: float = Field(description="In the score's own unit; larger is more similar.", examples=[0.83])


class Alternative(BaseModel):
    """Another transform that was considered."""

    target_from_reference: Similarity
    score: float = Field(description="Larger is better; to be compared with the pose's `score`.")
    confidence: float | None = Field(description="As the pose's.")


class Pose(BaseModel):
    """Where the object is and how it is turned."""

    target_from_reference: Similarity = Field(
        description="From the world frame of the category's reference scan to the world frame of this burst, metres both."
    )
    target_from_object: Stretch | None = Field(
        description="With dof=9: from the reference's object frame to the world frame of this burst, a scale for each axis."
    )
    not_9d_because: str | None = Field(description="Why there is none though it was asked for.")
    frame: str | None = Field(description="Name of the burst's world frame, which everything here is in.", examples=["map"])
    world_from_object: Matrix4 = Field(
        description="Rigid: the object frame (centre and axes of its box) in the burst's world frame, metres."
    )
    box: Box
    boxes_px: list[PixelBox | None] = Field(
        description="Of each view [left, top, right, bottom] around the box's corners, pixels; null where a corner is behind the camera."
    )
    symmetries: list[Quaternion] = Field(
        description="Rotations about the object frame's origin, (w, x, y, z) in that frame: turned by any of them, the pose means the same."
    )
    inliers: int = Field(description="Correspondences that agree with the transform.", examples=[118])
    correspondences: int = Field(description="Correspondences it was fitted to.", examples=[250])
    best_view: int = Field(description="Which of the burst's views has the most inliers, from 0; its pictures tell most.", examples=[2])
    residual_m: float = Field(description="Root mean square distance of the inliers after the transform, metres.", examples=[0.004])
    score: float | None = Field(description="How well both objects agree after the transform, in [0, 1], where the variant computes it.")
    confidence: float | None = Field(description="Probability that the rotation is within 30°, where the variant estimates one.")
    alternatives: list[Alternative] = Field(description="Other transforms that were considered, best first.")

    @staticmethod
    def of(pose: records.Pose, frame: str | None) -> Pose:
        """From the memory's record."""
        return Pose(
            target_from_reference=Similarity.of(pose.target_from_reference),
            target_from_object=Stretch.of(pose.target_from_object) if pose.target_from_object else None,
            not_9d_because=pose.not_9d_because,
            frame=frame,
            world_from_object=pose.box.world_from_object.tolist(),
            box=Box.of(pose.box),
            boxes_px=[list(box) if box else None for box in pose.boxes_px],
            symmetries=[_in_object_frame(turn, pose) for turn in pose.symmetries],
            inliers=pose.inliers,
            correspondences=pose.correspondences,
            best_view=pose.best_view,
            residual_m=pose.residual_m,
            score=pose.score,
            confidence=pose.confidence,
            alternatives=[
                Alternative(target_from_reference=Similarity.of(each.target_from_reference), score=each.score, confidence=each.confidence)
                for each in pose.alternatives
            ],
        )


def _in_object_frame(turn: FloatArray, pose: records.Pose) -> list[float]:
    """A rotation of the reference's world, shape (3, 3), as a quaternion of the object frame."""
    reference_from_object = pose.target_from_reference.rotation.T @ pose.box.world_from_object[:3, :3]
    rotation = reference_from_object.T @ turn @ reference_from_object
    quaternion: list[float] = Sim3(1.0, rotation, np.zeros(3)).quaternion.tolist()
    return quaternion


class Debug(BaseModel):
    """What a pose was computed from."""

    view_similarity: list[list[float]] = Field(
        description="Similarity of reference view m and burst view n, shape (M, N); 0 where they were not compared."
    )
    pairs: list[tuple[int, int]] = Field(description="(reference view, burst view) pairs whose correspondences were used.")


class Observation(BaseModel):
    """What was seen."""

    id: str = Field(description="Names it in /v1/observations/{id}.", examples=["9f1c1b8a4b0c4a0fb0a5c0b7f5a0d6c3"])
    created_at: CreatedAt
    frame: str | None = Field(description="Name of the burst's world frame, as it was sent.", examples=["map"])
    outcome: Outcome = Field(description="`known`: recognised; `novel`: of no category so far; `uncertain`: more views would settle it.")
    views: int = Field(description="Views the answer rests on.", examples=[5])
    category_id: str | None = Field(description="The category it was recognised as; null where it is none, or was deleted since.")
    name: str | None = Field(description="That category's name.")
    score: str | None = Field(description="The score behind the decision; null where the request named the category.")
    threshold: float | None = Field(description="Least similarity of a known object in this decision.")
    similarities: list[CategorySimilarity] = Field(
        description="Categories, most similar first; with the score `best` those few that match best."
    )
    similarity: float | None = Field(description="Of the most similar category.")
    margin: float | None = Field(description="By how much the most similar category leads the next.")
    uncertain_above: float | None = Field(description="Similarities between it and `threshold` are answered `uncertain`.")
    learn_above: float | None = Field(description="A known object joins its category above it: more than an answer needs.")
    probability: float | None = Field(
        description="Estimated, that the most similar category is right, at even odds beforehand; null for scores but `best`."
    )
    verified: bool = Field(description="Whether poses were tried to decide; that takes depth and cameras.")
    candidates: list[str] = Field(description="Categories that an uncertain object may be of; it may also be novel.")
    viewpoints: list[list[list[float]]] | None = Field(
        description="Of an uncertain object: world_from_camera of where to look next, the most telling first. "
        "Send the burst again with a view from there."
    )
    pose: Pose | None = Field(description="Of a known object.")
    pose_error: str | None = Field(description="Why a known object has no pose.")
    scan: scans.Scan | None = Field(description="Of a novel object: the views to take so that it becomes a category.")
    scan_error: str | None = Field(description="Why a novel object has no scan.")
    grounds: Grounds | None = Field(description="How much the answer rests on; null where an earlier version did not record it.")
    timings_ms: dict[str, float] = Field(description="Milliseconds of each stage, and their `total`.")
    corrected_to: str | None = Field(description="The category that somebody said it was of, by `correct`.")
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
            pose=Pose.of(observation.pose, observation.frame) if observation.pose else None,
            similarity=decision.similarity if decision else None,
            margin=decision.margin if decision else None,
            uncertain_above=decision.uncertain_above if decision else None,
            learn_above=decision.learn_above if decision else None,
            probability=decision.probability if decision else None,
            verified=decision.verified if decision else False,
            candidates=list(decision.candidates) if decision and observation.outcome == "uncertain" else [],
            viewpoints=None if observation.viewpoints is None else observation.viewpoints.tolist(),
            pose_error=observation.pose_error,
            scan=scan,
            scan_error=observation.scan_error,
            grounds=Grounds.of(observation.grounds) if observation.grounds else None,
            timings_ms=observation.timings_ms,
            corrected_to=observation.corrected_to,
            debug=debug,
        )


class Correction(BaseModel):
    """What an observation was really of."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"category_id": "4be0643f1d98573b97cdca98a65347dd"}})

    category_id: str | None = Field(description="The right category; null for a new one, made of the observation's own views.")
    name: str | None = Field(None, min_length=1, max_length=LONGEST_NAME, description="Of the new category.", examples=["cup"])

    @model_validator(mode="after")
    def _only_new_ones_are_named(self) -> Correction:
        if self.category_id is not None and self.name is not None:
            raise ValueError("name is of a new category; PATCH /v1/categories/{id} names one that there is")
        return self


class ObservationList(BaseModel):
    """The latest observations, newest first."""

    observations: list[Observation]
