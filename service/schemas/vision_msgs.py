"""Observations in the shape of ROS 2 vision_msgs/msg/Detection3DArray: the field names are the messages' own."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

import numpy as np
from pydantic import BaseModel, Field

from core.sim3 import Sim3
from core.views import FloatArray
from store import records


class Time(BaseModel):
    """builtin_interfaces/msg/Time."""

    sec: int
    nanosec: int


class Header(BaseModel):
    """std_msgs/msg/Header."""

    stamp: Time
    frame_id: str


class Point(BaseModel):
    """geometry_msgs/msg/Point and Vector3."""

    x: float
    y: float
    z: float


class Orientation(Point):
    """geometry_msgs/msg/Quaternion: w comes last here, as in ROS."""

    w: float


class RosPose(BaseModel):
    """geometry_msgs/msg/Pose."""

    position: Point
    orientation: Orientation


class PoseWithCovariance(BaseModel):
    """geometry_msgs/msg/PoseWithCovariance."""

    pose: RosPose
    covariance: list[float] = Field(min_length=36, max_length=36, description="All 0: unknown.")


class ObjectHypothesis(BaseModel):
    """vision_msgs/msg/ObjectHypothesis."""

    class_id: str = Field(description="The category's id.")
    score: float = Field(description="The pose's confidence, where the variant estimates one, else its score; 0 where it has neither.")


class ObjectHypothesisWithPose(BaseModel):
    """vision_msgs/msg/ObjectHypothesisWithPose."""

    hypothesis: ObjectHypothesis
    pose: PoseWithCovariance


class BoundingBox3D(BaseModel):
    """vision_msgs/msg/BoundingBox3D."""

    center: RosPose
    size: Point


class Detection3D(BaseModel):
    """vision_msgs/msg/Detection3D."""

    header: Header
    results: list[ObjectHypothesisWithPose]
    bbox: BoundingBox3D
    id: str = Field(description="The category's name, else its id.")


class Detection3DArray(BaseModel):
    """vision_msgs/msg/Detection3DArray: one detection where the object has a pose, none else."""

    header: Header
    detections: list[Detection3D]

    @staticmethod
    def of(observation: records.Observation, names: Mapping[str, str | None]) -> Detection3DArray:
        """From the memory's record; `names` are the categories' by id."""
        since_epoch = datetime.fromisoformat(observation.created_at).timestamp()
        stamp = Time(sec=int(since_epoch), nanosec=round(since_epoch % 1 * 1e9))
        header = Header(stamp=stamp, frame_id=observation.frame or "")
        pose, category_id = observation.pose, observation.category_id
        if pose is None or category_id is None:
            return Detection3DArray(header=header, detections=[])
        placed = _pose(pose.box.world_from_object)
        score = next((value for value in (pose.confidence, pose.score) if value is not None), 0.0)
        result = ObjectHypothesisWithPose(
            hypothesis=ObjectHypothesis(class_id=category_id, score=score), pose=PoseWithCovariance(pose=placed, covariance=[0.0] * 36)
        )
        box = BoundingBox3D(center=placed, size=_point(pose.box.extent_m))
        name = names.get(category_id) or category_id
        return Detection3DArray(header=header, detections=[Detection3D(header=header, results=[result], bbox=box, id=name)])


def _point(values: FloatArray) -> Point:
    x, y, z = np.asarray(values).tolist()
    return Point(x=x, y=y, z=z)


def _pose(matrix: FloatArray) -> RosPose:
    w, x, y, z = Sim3.from_matrix(matrix).quaternion.tolist()
    return RosPose(position=_point(matrix[:3, 3]), orientation=Orientation(x=x, y=y, z=z, w=w))
