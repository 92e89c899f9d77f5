"""What a row keeps as JSON comes back as it was."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.grounds import Grounds
from core.pose_estimate import Alternative
from core.quality import ViewFault
from core.scan import ScanRequest
from core.sim3 import Sim3
from store.columns import grounds_from_json, grounds_to_json, pose_from_json, pose_to_json, request_from_json, request_to_json
from store.records import Pose

TURN = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
PLACED = Sim3(0.7, TURN, np.array([1.0, 2, 3]))
FRAME = np.block([[TURN, np.array([[4.0], [5], [6]])], [np.eye(4)[3]]])
STRETCHED = Affine9(np.array([0.5, 0.6, 0.7]), TURN, np.array([7.0, 8, 9]))


def pose(**changes: object) -> Pose:
    about = {
        "target_from_reference": PLACED,
        "box": OrientedBox(FRAME, np.array([0.1, 0.2, 0.3])),
        "inliers": 10,
        "correspondences": 20,
        "best_view": 3,
        "residual_m": 0.01,
        "score": 0.7,
        "confidence": 0.8,
        "alternatives": (Alternative(PLACED, 0.5, 0.1),),
        "boxes_px": ((1.0, 2.0, 3.0, 4.0), None),
        "target_from_object": STRETCHED,
        "not_9d_because": "it is flat",
        "symmetries": np.stack([np.eye(3), TURN]),
    }
    return Pose(**about | changes)


def numbers(record: object) -> object:
    """All of a record as lists, for comparing."""
    if isinstance(record, np.ndarray):
        return record.tolist()
    if isinstance(record, (tuple, list)):
        return [numbers(each) for each in record]
    return {name: numbers(each) for name, each in vars(record).items()} if hasattr(record, "__dict__") else record


@pytest.mark.parametrize("changes", [{}, {"target_from_object": None, "not_9d_because": None, "symmetries": np.empty((0, 3, 3))}])
def test_a_pose_comes_back(changes: dict[str, object]) -> None:
    found = pose_from_json(pose_to_json(pose(**changes)))
    assert numbers(found) == numbers(pose(**changes))
    assert found.symmetries.shape == pose(**changes).symmetries.shape
    assert isinstance(found.boxes_px[0], tuple)


def test_a_pose_of_an_earlier_version_has_what_there_was_not_yet_empty() -> None:
    kept = json.loads(pose_to_json(pose()))
    for name in ("boxes_px", "target_from_object", "not_9d_because", "symmetries"):
        del kept[name]
    found = pose_from_json(json.dumps(kept))
    assert (found.boxes_px, found.target_from_object, found.not_9d_because, found.symmetries.shape) == ((), None, None, (0, 3, 3))


def test_what_an_answer_rests_on_comes_back() -> None:
    told = Grounds(3, 2, 1, 40.0, ((ViewFault("blur", "it is blurred"),), (), ()))
    assert grounds_from_json(grounds_to_json(told)) == told


def test_a_request_for_views_comes_back() -> None:
    asked = ScanRequest(
        np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.6, 0.8]), 0.8, np.stack([FRAME, np.eye(4)]), 0.3, "cameras", np.stack([FRAME])
    )
    assert numbers(request_from_json(request_to_json(asked))) == numbers(asked)


def test_a_request_of_an_earlier_version_was_about_an_object_half_as_large_as_it_is_far() -> None:
    kept = json.loads(request_to_json(ScanRequest(np.zeros(3), np.array([0.0, 0, 1]), 0.8, np.stack([FRAME]), 0.1, "given")))
    for name in ("extent_m", "up_from", "excluded"):
        del kept[name]
    found = request_from_json(json.dumps(kept))
    assert (found.extent_m, found.up_from, found.excluded.shape) == (0.4, "cameras", (0, 4, 4))
