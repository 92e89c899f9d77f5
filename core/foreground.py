"""What of a close crop is the object: two saliency passes and, with depth, the surface it stands on.

Letters: S crop side in pixels.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray

Mask = NDArray[np.bool_]

PLANE_TRIALS = 200
"""Of RANSAC: planes through three points each."""
PLANE_SAMPLE = 2000
"""Background points that the plane is fitted to."""
MIN_PLANE_POINTS = 200
"""Background points below which no support is looked for."""
LEAST_NORMAL = 1e-12
"""Length of the cross product of two sides, m², below which three points lie on one line and span no plane."""
PLANE_TOLERANCE = 0.01
"""Inlier distance, as all lengths below a share of the window's width at the object's distance."""
ON_PLANE = 0.02
"""Nearer to the plane than this is the support, and voted down."""
ABOVE_PLANE = 0.03
"""Higher than this is off the support, and voted up; between the two a noisy plane tells nothing, and there is no vote."""
MAX_HEIGHT = 1.5
"""Higher than this above the support is another surface."""
FAR_BACKGROUND = 1.6
"""What is more than this many times as far as the object says nothing of its support, and is no part of it."""
PLANE_VOTE = 0.3
"""Probability that being off or on the support adds or takes."""
SMOOTHING = 7
"""Side of the median filter that removes single votes on noisy depth, pixels of the crop."""


def otsu_threshold(soft: FloatArray) -> float:
    """The threshold in (0, 1] that best splits the histogram of `soft`, of any shape (Otsu 1979).

    A fixed threshold fails where the decoder is unsure of a whole object: its map is then low, but still flat and well above the rest.
    """
    threshold, _ = cv2.threshold((np.clip(soft, 0, 1) * 255).astype(np.uint8), 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    return (float(threshold) + 1) / 255  # the first level above the threshold


def vote_by_support(soft: FloatArray, points_m: FloatArray, usable: Mask, width_m: float) -> FloatArray:
    """`soft`, shape (S, S), raised above the surface that the object stands on and lowered on it.

    Args:
        points_m: in the camera frame, shape (S, S, 3).
        usable: where they were measured, shape (S, S).
        width_m: the window's width at the object's distance.

    Returns `soft` unchanged where no such surface is seen.
    """
    threshold = otsu_threshold(soft)
    likely = usable & (soft > threshold)
    if not likely.any():
        return soft
    reach = FAR_BACKGROUND * np.median(points_m[likely][:, 2])
    near = usable & (points_m[..., 2] < reach)
    background = points_m[near & (soft < threshold)]
    if len(background) < MIN_PLANE_POINTS:
        return soft
    normal, origin = fit_plane(background, PLANE_TOLERANCE * width_m)
    height = (points_m - origin) @ normal / width_m
    on_support = near & (np.abs(height) < ON_PLANE)
    above = near & (height > ABOVE_PLANE) & (height < MAX_HEIGHT)
    voted = np.clip(soft + PLANE_VOTE * above - PLANE_VOTE * on_support, 0, 1)
    smooth = cv2.medianBlur((voted * 255).astype(np.uint8), SMOOTHING)
    return np.asarray(smooth, dtype=np.float32) / 255


def fit_plane(points: FloatArray, tolerance_m: float) -> tuple[FloatArray, FloatArray]:
    """Unit normal towards the camera at the origin, and a point, of the plane with the most points within `tolerance_m`.

    RANSAC over points, shape (N, 3), N ≥ 3, with a fixed seed, and a least-squares fit to the inliers.
    """
    rng = np.random.default_rng(0)
    kept = points[rng.permutation(len(points))[:PLANE_SAMPLE]].astype(np.float32)
    corners = kept[rng.integers(0, len(kept), (PLANE_TRIALS, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    spans = length > LEAST_NORMAL
    normals, anchors = normals[spans] / length[spans, None], corners[spans, 0]
    near = np.abs(kept @ normals.T - (anchors * normals).sum(axis=1)) < tolerance_m
    inliers = kept[near[:, int(near.sum(axis=0).argmax())]]
    origin = inliers.mean(axis=0)
    normal = np.linalg.svd(inliers - origin, full_matrices=False)[2][2]
    return normal * np.sign(-(normal @ origin) or 1.0), origin
