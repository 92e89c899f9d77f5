"""How far an estimated 7-D transform is from the truth, modulo the object's symmetries, and figures over many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.sim3 import Sim3, rotation_angle_deg
from core.views import FloatArray


@dataclass(frozen=True)
class PoseError:
    """One estimate against the truth."""

    rotation_deg: float
    """Geodesic angle in degrees, the smallest over the target's symmetries."""
    translation: float
    """Distance between where the reference model's centre lands and the target's, over the target's diagonal."""
    log_scale: float
    """|log(estimated scale / true scale)|, natural logarithm."""


NO_POSE = PoseError(180.0, np.inf, np.inf)
"""What a refused pose counts as: the worst there is."""


def pose_error(estimate: Sim3, reference_from_model: Sim3, target_from_model: Sim3, symmetries: Sequence[FloatArray] = ()) -> PoseError:
    """The error of `estimate`, a target_from_reference.

    Args:
        reference_from_model, target_from_model: each object's model frame (bounding-box centre 0, diagonal 1, one orientation a
            category) in its world, so that a scale is the object's diagonal in metres.
        symmetries: rotations, each (3, 3), of the target's model onto itself; the identity goes without saying.
    """
    target_from_reference = target_from_model @ reference_from_model.inverse()
    landed = estimate.apply(reference_from_model.translation)
    return PoseError(
        rotation_deg=rotation_error_deg(estimate.rotation, reference_from_model, target_from_model, symmetries),
        translation=float(np.linalg.norm(landed - target_from_model.translation) / target_from_model.scale),
        log_scale=float(abs(np.log(estimate.scale / target_from_reference.scale))),
    )


def rotation_error_deg(
    rotation: FloatArray, reference_from_model: Sim3, target_from_model: Sim3, symmetries: Sequence[FloatArray] = ()
) -> float:
    """Of a target_from_reference rotation, shape (3, 3), alone. See `pose_error`."""
    model_rotation = target_from_model.rotation.T @ rotation @ reference_from_model.rotation
    return float(rotation_angle_deg(np.stack([np.eye(3), *symmetries]), model_rotation[None]).min())


def accuracy(errors: Sequence[PoseError], threshold_deg: float) -> float:
    """Percentage of `errors` whose rotation is at most `threshold_deg` off."""
    return 100 * float(np.mean([error.rotation_deg <= threshold_deg for error in errors]))


def median(errors: Sequence[PoseError], field: str) -> float:
    """Median of one field of PoseError; infinite where at least half of the poses were refused."""
    return float(np.median([getattr(error, field) for error in errors]))
