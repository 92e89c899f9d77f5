"""Finds what each picture is drawn from in the memory."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import open3d as o3d

from core.descriptors import PcaBasis
from core.encode import EncodedView
from core.errors import NotFound
from core.views import View
from service import pictures
from service.agent import Agent
from service.features import PoseDetails, pose_details_from_arrays
from service.pictures import ComponentColours, Picture


class CategoryGallery:
    """Pictures of one category's reference. Every method raises NotFound for a view it does not have."""

    def __init__(self, agent: Agent, category_id: str) -> None:
        self._categories = agent.memory.categories
        self._id = category_id

    def rgb(self, index: int) -> Picture:
        """The view as it came."""
        return self._categories.view(self._id, index).rgb

    def depth(self, index: int) -> Picture:
        """Raises NotFound also for a view without depth."""
        depth_m = self._categories.view(self._id, index).depth_m
        if depth_m is None:
            raise NotFound(f"view {index} of category {self._id!r} has no depth")
        return pictures.depth_picture(depth_m)

    def mask(self, index: int) -> Picture:
        """See `pictures.mask_picture`."""
        return pictures.mask_picture(self._categories.view(self._id, index), self._categories.reference(self._id).views[index])

    def saliency(self, index: int) -> Picture:
        """See `pictures.saliency_picture`."""
        self._categories.view(self._id, index)
        return pictures.saliency_picture(self._categories.reference(self._id).views[index])

    def foreground(self, index: int) -> Picture:
        """See `pictures.foreground_picture`."""
        return pictures.foreground_picture(self._categories.view(self._id, index), self._categories.reference(self._id).views[index])

    def pca(self, index: int) -> Picture:
        """See `pictures.pca_picture`."""
        view = self._categories.view(self._id, index)
        reference = self._categories.reference(self._id)
        return pictures.pca_picture(view, reference.views[index], ComponentColours.of(reference.basis, reference.views))

    def overlay(self, index: int) -> Picture:
        """See `pictures.overlay_picture`; the box is the reference's own."""
        view = self._categories.view(self._id, index)
        assert view.camera is not None, "a reference is made of views with cameras"
        return pictures.overlay_picture(view, view.camera, self._categories.reference(self._id).box)

    def cloud_ply(self) -> bytes:
        """The reference's points as a binary PLY file, metres in the world frame of its scan."""
        points = o3d.utility.Vector3dVector(self._categories.reference(self._id).cloud_m.astype(np.float64))
        with tempfile.TemporaryDirectory() as folder:  # Open3D writes to a path only
            path = Path(folder) / "cloud.ply"
            o3d.io.write_point_cloud(path, o3d.geometry.PointCloud(points))
            return path.read_bytes()


class ObservationGallery:
    """Pictures of one observation. Every method raises NotFound for a view it does not have."""

    def __init__(self, agent: Agent, observation_id: str) -> None:
        self._agent = agent
        self._observations = agent.memory.observations
        self._id = observation_id

    def rgb(self, index: int) -> Picture:
        """The view as it came."""
        return self._observations.view(self._id, index).rgb

    def foreground(self, index: int) -> Picture:
        """See `pictures.foreground_picture`."""
        return pictures.foreground_picture(*self._view(index))

    def pca(self, index: int) -> Picture:
        """In the colours of the category that it was recognised as or that its scan made; else in its own."""
        category_id = self._category_id()
        if category_id is None:
            views = self._agent.encoded(self._id).views
            colours = ComponentColours.of(PcaBasis.fit(np.concatenate([view.descriptors for view in views])), views)
        else:
            reference = self._agent.memory.categories.reference(category_id)
            colours = ComponentColours.of(reference.basis, reference.views)
        return pictures.pca_picture(*self._view(index), colours)

    def overlay(self, index: int) -> Picture:
        """Raises NotFound also where there is no pose to draw."""
        pose = self._observations.get(self._id).pose
        view = self._observations.view(self._id, index)
        if pose is None or view.camera is None:
            raise NotFound(f"observation {self._id!r} has no pose to draw")
        return pictures.overlay_picture(view, view.camera, pose.box)

    def correspondences(self, index: int | None) -> Picture:
        """Of one view and its best reference view; of the pose's `best_view` where `index` is None.

        Raises NotFound also where there is no pose, its category was deleted, or the memory was computed anew since.
        """
        details = pose_details_from_arrays(self._observations.features(self._id))
        category_id = self._observations.get(self._id).category_id
        if details is None or category_id is None:
            why = "it has no pose, its category was deleted, or the memory was computed anew since"
            raise NotFound(f"observation {self._id!r} has no correspondences: {why}")
        reference_view, target_view = _pair(details, index)
        matches = details.matches
        chosen = (matches.reference_view == reference_view) & (matches.target_view == target_view)
        categories = self._agent.memory.categories
        return pictures.correspondence_picture(
            (categories.view(category_id, reference_view), categories.reference(category_id).views[reference_view]),
            self._view(target_view),
            (matches.reference_patch[chosen], matches.target_patch[chosen]),
            matches.similarity[chosen],
            matches.inlier[chosen],
        )

    def _view(self, index: int) -> tuple[View, EncodedView]:
        return self._observations.view(self._id, index), self._agent.encoded(self._id).views[index]

    def _category_id(self) -> str | None:
        observation = self._observations.get(self._id)
        if observation.category_id is not None or observation.scan_id is None:
            return observation.category_id
        return self._agent.memory.scans.get(observation.scan_id).category_id


def _pair(details: PoseDetails, index: int | None) -> tuple[int, int]:
    """(reference view, target view): the used pair with the most inliers, among those of view `index` where it is given."""
    pairs = [pair for pair in details.pairs if index in (None, pair[1])]
    if not pairs:
        used = ", ".join(str(view) for view in sorted({target for _, target in details.pairs}))
        raise NotFound(f"the pose does not rest on view {index}; it rests on the views {used}")
    return details.matches.best_pair(pairs)
