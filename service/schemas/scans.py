"""Scans as JSON."""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from service.schemas.categories import Name
from service.schemas.geometry import Matrix4, Vector3
from store import records


class Scan(BaseModel):
    """A request for views of one object, in the world frame of the burst that it came from."""

    id: str = Field(description="Names it in /v1/scans/{id}.", examples=["0c4c2ee3c8d44b7f8f4f39d1be3d2f0a"])
    state: records.ScanState = Field(
        description="`requested` before the first views, `collecting` after, `completed` once it is a category."
    )
    created_at: str = Field(description="ISO 8601, UTC.", examples=["2026-01-31T12:00:00.000+00:00"])
    center_m: Vector3 = Field(description="Centre of the object seen, metres in the burst's world frame.")
    up: Vector3 = Field(description="Unit vector that the hemisphere of viewpoints opens along, in the same frame.")
    radius_m: float = Field(description="Distance of the viewpoints from the centre, metres.", examples=[0.6])
    world_from_camera: list[Matrix4] = Field(
        description="Camera poses to take the views from, OpenCV axes, looking at the centre; near ones will do."
    )
    views: int = Field(description="Views received so far; of a completed scan 0, the category has them.")
    views_required: int = Field(description="Fewest views that make a category.", examples=[2])
    observation_id: str | None = Field(description="The observation that asked for it.")
    category_id: str | None = Field(description="The category that the completed scan made.")

    @staticmethod
    def of(scan: records.Scan, views_required: int) -> Scan:
        """From the memory's record."""
        request = scan.request
        return Scan(
            id=scan.id,
            state=scan.state,
            created_at=scan.created_at,
            center_m=np.asarray(request.center_m).tolist(),
            up=np.asarray(request.up).tolist(),
            radius_m=float(request.radius_m),
            world_from_camera=np.asarray(request.world_from_camera).tolist(),
            views=scan.views,
            views_required=views_required,
            observation_id=scan.observation_id,
            category_id=scan.category_id,
        )


class ScanBegin(BaseModel):
    """A scan of an object that was observed before."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"observation_id": "9f1c1b8a4b0c4a0fb0a5c0b7f5a0d6c3"}})

    observation_id: str = Field(description="An observation whose views have cameras and depth.")


class ScanComplete(BaseModel):
    """How the new category is called."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"name": "cup"}})

    name: str | None = Name
