"""Scans as JSON.

Letters: n viewpoints, V views received.
"""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from core.scan import ScanOptions, UpSource
from service.scanning import Progress
from service.schemas.fields import CreatedAt, Name
from service.schemas.geometry import Direction, Matrix4, Vector3, as_up
from service.schemas.quality import Fault
from service.settings import MOST_VIEWPOINTS
from store import records


class ReceivedView(BaseModel):
    """A view that was accepted."""

    viewpoint: int | None = Field(description="The viewpoint it was taken near, from 0; null where it is near none.", examples=[3])
    angle_deg: float = Field(description="Angle about the object to the nearest viewpoint.", examples=[4.2])
    faults: list[Fault] = Field(description="What is wrong with it; better send another one from there.")


class Scan(BaseModel):
    """A request for views of one object, in the world frame of the burst that it came from."""

    id: str = Field(description="Names it in /v1/scans/{id}.", examples=["0c4c2ee3c8d44b7f8f4f39d1be3d2f0a"])
    state: records.ScanState = Field(
        description=(
            "`requested` before the first views, `collecting` after, `completed` once it is a category, `expired` where no views came."
        )
    )
    created_at: CreatedAt
    expires_at: str = Field(
        description="When it ends unless more views come before; ISO 8601, UTC.", examples=["2026-02-01T12:00:00.000+00:00"]
    )
    center_m: Vector3 = Field(description="Centre of the object seen, metres in the burst's world frame.")
    extent_m: float = Field(description="Its diameter as far as it was seen, metres.", examples=[0.15])
    up: Vector3 = Field(description="Unit vector that the hemisphere of viewpoints opens along, in the same frame.")
    up_from: UpSource = Field(
        description="`given`; told from the `cameras`, held level; or `assumed`, since the views look from one direction: better give it."
    )
    radius_m: float = Field(description="Distance of the viewpoints from the centre, metres.", examples=[0.6])
    world_from_camera: list[Matrix4] = Field(
        description="Camera poses to take the views from, OpenCV axes, looking at the centre; near ones will do."
    )
    covered: list[bool] = Field(description="Of each viewpoint whether a view was taken near it.")
    coverage: float = Field(description="Share of the viewpoints that are covered.", examples=[0.4])
    excluded: int = Field(description="Viewpoints that were excluded as unreachable, and replaced.", examples=[0])
    views: int = Field(description="Views received so far; of a completed scan 0, the category has them.")
    received: list[ReceivedView] = Field(description="Of each of them, in the order they came.")
    views_required: int = Field(description="Fewest views that make a category.", examples=[2])
    observation_id: str | None = Field(description="The observation that asked for it.")
    category_id: str | None = Field(description="The category that the completed scan made.")

    @staticmethod
    def of(scan: records.Scan, progress: Progress, views_required: int) -> Scan:
        """From the memory's record and how far it is."""
        request, coverage = scan.request, progress.coverage
        return Scan(
            id=scan.id,
            state=scan.state,
            created_at=scan.created_at,
            expires_at=scan.expires_at,
            center_m=np.asarray(request.center_m).tolist(),
            extent_m=float(request.extent_m),
            up=np.asarray(request.up).tolist(),
            up_from=request.up_from,
            radius_m=float(request.radius_m),
            world_from_camera=np.asarray(request.world_from_camera).tolist(),
            covered=list(coverage.covered),
            coverage=float(np.mean(coverage.covered)),
            excluded=len(request.excluded),
            views=scan.views,
            received=[
                ReceivedView(viewpoint=viewpoint, angle_deg=angle, faults=Fault.of(faults))
                for viewpoint, angle, faults in zip(coverage.viewpoint, coverage.angle_deg, progress.faults)
            ],
            views_required=views_required,
            observation_id=scan.observation_id,
            category_id=scan.category_id,
        )


class ScanList(BaseModel):
    """Scans in progress, the latest begun first."""

    scans: list[Scan]


class ScanQuery(BaseModel):
    """Query options of a scan."""

    model_config = ConfigDict(extra="forbid")

    viewpoints: int | None = Field(
        None, ge=2, le=MOST_VIEWPOINTS, description="How many; the paper takes 10 or 20. ONELOOK_SCAN_VIEWS where left out."
    )
    up: Direction | None = Field(
        None, description="Away from the support, in the burst's world frame: `up=0&up=0&up=1`; told from the cameras where left out."
    )
    standoff_m: float | None = Field(
        None, gt=0, le=100, description="Distance of the viewpoints from the object; from its size and K where left out."
    )

    def options(self, viewpoints: int) -> ScanOptions:
        """As core has them; `viewpoints` where the caller does not say."""
        return ScanOptions(self.viewpoints or viewpoints, as_up(self.up), self.standoff_m)


class ScanExclude(BaseModel):
    """Viewpoints that the robot cannot reach."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"viewpoints": [2, 7]}})

    viewpoints: list[int] = Field(min_length=1, max_length=MOST_VIEWPOINTS, description="Which of `world_from_camera`, from 0.")


class ScanComplete(BaseModel):
    """How the new category is called."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"name": "cup"}})

    name: str | None = Name
