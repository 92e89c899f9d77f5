"""Records as columns of a row, and back: JSON where a column holds more than one number.

Letters: n requested viewpoints.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.grounds import Grounds
from core.novelty import Decision
from core.pose_estimate import Alternative
from core.quality import ViewFault
from core.scan import ScanRequest
from core.sim3 import Sim3
from store.folders import Files, FileSum
from store.records import Pose

DECISIONS_KEPT = 1024
AFFINE9 = ("scales", "rotation", "translation")


def files_to_json(files: Files) -> str:
    """One TEXT column."""
    return json.dumps({name: [file.size, file.sha256] for name, file in files.items()})


def files_from_json(text: str) -> dict[str, FileSum]:
    """The inverse of `files_to_json`."""
    return {name: FileSum(*entry) for name, entry in json.loads(text).items()}


def sim3_to_json(transform: Sim3) -> str:
    """One TEXT column."""
    return json.dumps(_sim3(transform))


def sim3_from_json(text: str) -> Sim3:
    """The inverse of `sim3_to_json`."""
    return _as_sim3(json.loads(text))


def request_to_json(request: ScanRequest) -> str:
    """One TEXT column."""
    arrays = {name: getattr(request, name).tolist() for name in ("center_m", "up", "world_from_camera", "excluded")}
    return json.dumps(arrays | {"radius_m": request.radius_m, "extent_m": request.extent_m, "up_from": request.up_from})


def request_from_json(text: str) -> ScanRequest:
    """The inverse of `request_to_json`."""
    fields = json.loads(text)
    return ScanRequest(
        center_m=np.array(fields["center_m"]),
        up=np.array(fields["up"]),
        radius_m=fields["radius_m"],
        world_from_camera=np.array(fields["world_from_camera"]),
        extent_m=fields.get("extent_m", fields["radius_m"] / 2),
        up_from=fields.get("up_from", "cameras"),
        excluded=np.array(fields.get("excluded", ())).reshape(-1, 4, 4),
    )


def decision_to_json(decision: Decision) -> str:
    """One TEXT column."""
    return json.dumps(vars(decision))


@lru_cache(maxsize=DECISIONS_KEPT)
def decision_from_json(text: str) -> Decision:
    """The inverse of `decision_to_json`; every decision reads the latest few hundred, all but one of them again."""
    fields = json.loads(text)
    similarities = tuple((category_id, similarity) for category_id, similarity in fields.pop("similarities"))
    return Decision(**fields, similarities=similarities)


def pose_to_json(pose: Pose) -> str:
    """One TEXT column."""
    return json.dumps(
        {
            "target_from_reference": _sim3(pose.target_from_reference),
            "box": {"world_from_object": pose.box.world_from_object.tolist(), "extent_m": pose.box.extent_m.tolist()},
            "inliers": pose.inliers,
            "correspondences": pose.correspondences,
            "best_view": pose.best_view,
            "residual_m": pose.residual_m,
            "score": pose.score,
            "confidence": pose.confidence,
            "alternatives": [[_sim3(each.target_from_reference), each.score, each.confidence] for each in pose.alternatives],
            "boxes_px": pose.boxes_px,
            "target_from_object": _affine9(pose.target_from_object) if pose.target_from_object else None,
            "not_9d_because": pose.not_9d_because,
            "symmetries": pose.symmetries.tolist(),
        }
    )


def pose_from_json(text: str) -> Pose:
    """The inverse of `pose_to_json`."""
    fields = json.loads(text)
    box = OrientedBox(np.array(fields["box"]["world_from_object"]), np.array(fields["box"]["extent_m"]))
    alternatives = tuple(Alternative(_as_sim3(transform), *judged) for transform, *judged in fields["alternatives"])
    stretched = fields.get("target_from_object")
    return Pose(
        _as_sim3(fields["target_from_reference"]),
        box,
        fields["inliers"],
        fields["correspondences"],
        fields["best_view"],
        fields["residual_m"],
        fields["score"],
        fields["confidence"],
        alternatives,
        tuple(each and tuple(each) for each in fields.get("boxes_px", ())),
        Affine9(*(np.array(stretched[name]) for name in AFFINE9)) if stretched else None,
        fields.get("not_9d_because"),
        np.array(fields.get("symmetries", ())).reshape(-1, 3, 3),
    )


def grounds_to_json(grounds: Grounds) -> str:
    """One TEXT column."""
    return json.dumps(asdict(grounds))


def grounds_from_json(text: str) -> Grounds:
    """The inverse of `grounds_to_json`."""
    fields = json.loads(text)
    faults = tuple(tuple(ViewFault(**fault) for fault in view) for view in fields.pop("faults"))
    return Grounds(**fields, faults=faults)


def _affine9(transform: Affine9) -> dict[str, Any]:
    return {name: np.asarray(getattr(transform, name)).tolist() for name in AFFINE9}


def _sim3(transform: Sim3) -> dict[str, Any]:
    return {"scale": transform.scale, "rotation": transform.rotation.tolist(), "translation": transform.translation.tolist()}


def _as_sim3(fields: dict[str, Any]) -> Sim3:
    rotation: NDArray[np.floating] = np.array(fields["rotation"])
    return Sim3(fields["scale"], rotation, np.array(fields["translation"]))
