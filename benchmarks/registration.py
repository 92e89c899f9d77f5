"""Registration of two objects' clouds by shape alone, with Open3D: what pose is without appearance.

Both match FPFH descriptors (Rusu 2009). `fpfh` then runs RANSAC, `fgr` Fast Global Registration (Zhou 2016). Both find rigid motions: the
scale is set beforehand, as the ratio of the two clouds' extents.

Letters: N points.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

from core.boxes import cloud_extent_m
from core.encode import EncodedBurst
from core.errors import NoPose
from core.sim3 import Sim3
from core.views import FloatArray

METHODS = ("fpfh", "fgr")
DESCRIPTOR_SIZE = 33
"""Of FPFH."""
VOXEL = 0.05
"""Grid of the downsampled clouds as a share of the extent. The radii and distances in units of it are those of Open3D's tutorial on
global registration: 2 for normals, 5 for descriptors, 1.5 and 0.5 for correspondences of RANSAC and FGR."""
RANSAC_TRIALS = 100_000
RANSAC_CONFIDENCE = 0.999
MIN_EDGE_RATIO = 0.9
"""Of an edge of a sample in both clouds, the shorter over the longer. This and RANSAC's trials and confidence are the tutorial's, too."""

_registration = o3d.pipelines.registration


def register(reference: EncodedBurst, target: EncodedBurst, method: str, seed: int) -> Sim3:
    """target_from_reference by one of METHODS. Raises NoPose where nothing corresponds."""
    extents_m = [cloud_extent_m(burst.cloud_m) for burst in (reference, target)]
    if min(extents_m) <= 0:
        raise NoPose("one of the objects has no depth")
    scale = extents_m[1] / extents_m[0]
    voxel_m = VOXEL * extents_m[1]
    source, aim = _cloud(reference, scale, voxel_m), _cloud(target, 1.0, voxel_m)
    search = o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel_m, max_nn=100)
    # Its stub does not know that the indices may be left out.
    features = [_registration.compute_fpfh_feature(cloud, search) for cloud in (source, aim)]  # type: ignore[call-arg]
    o3d.utility.random.seed(seed)
    solve = _by_ransac if method == "fpfh" else _by_fgr
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):  # it warns of falling back to matches that are not mutual
        result = solve(source, aim, features[0], features[1], voxel_m)
    if not result.fitness > 0:
        raise NoPose("no descriptors of the two clouds correspond")
    matrix = np.asarray(result.transformation)
    return Sim3(scale, matrix[:3, :3], matrix[:3, 3])


def _by_ransac(
    source: o3d.geometry.PointCloud,
    target: o3d.geometry.PointCloud,
    source_features: _registration.Feature,
    target_features: _registration.Feature,
    voxel_m: float,
) -> _registration.RegistrationResult:
    distance_m = 1.5 * voxel_m
    return _registration.registration_ransac_based_on_feature_matching(
        source,
        target,
        source_features,
        target_features,
        mutual_filter=True,
        max_correspondence_distance=distance_m,
        estimation_method=_registration.TransformationEstimationPointToPoint(with_scaling=False),
        ransac_n=3,
        checkers=[
            _registration.CorrespondenceCheckerBasedOnEdgeLength(MIN_EDGE_RATIO),
            _registration.CorrespondenceCheckerBasedOnDistance(distance_m),
        ],
        criteria=_registration.RANSACConvergenceCriteria(RANSAC_TRIALS, RANSAC_CONFIDENCE),
    )


def _by_fgr(
    source: o3d.geometry.PointCloud,
    target: o3d.geometry.PointCloud,
    source_features: _registration.Feature,
    target_features: _registration.Feature,
    voxel_m: float,
) -> _registration.RegistrationResult:
    option = _registration.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * voxel_m)
    return _registration.registration_fgr_based_on_feature_matching(source, target, source_features, target_features, option)


def _cloud(encoded: EncodedBurst, scale: float, voxel_m: float) -> o3d.geometry.PointCloud:
    """A burst's points times `scale`, downsampled, with normals that face the cameras."""
    parts = []
    for view in encoded.views:
        points = view.points_m[view.trusted].astype(np.float64)
        if len(points) and view.camera is not None:
            parts.append((points, np.broadcast_to(view.camera.world_from_camera[:3, 3], points.shape)))
    points, cameras = (np.concatenate(side) for side in zip(*parts, strict=True))
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points * scale))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * voxel_m, max_nn=30))
    cloud.normals = o3d.utility.Vector3dVector(_facing(np.asarray(cloud.normals), cameras - points))
    return cloud.voxel_down_sample(voxel_m)


def _facing(normals: FloatArray, ways: FloatArray) -> FloatArray:
    """Normals, shape (N, 3), turned to the side that `ways`, shape (N, 3), go to."""
    return normals * np.where((normals * ways).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
