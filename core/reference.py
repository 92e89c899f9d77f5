"""A reference: what is kept of the one object that a category was learnt from.

Letters: M views, P foreground patches of a view, D token size, N cloud points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.boxes import OrientedBox, oriented_box, remove_outliers
from core.crop import Window
from core.descriptors import PcaBasis
from core.encode import EncodedBurst, EncodedView
from core.errors import TooFewViews
from core.views import Camera

MIN_VIEWS = 2
"""One view shows one side only; no transform to the other sides could be found."""


@dataclass(frozen=True, eq=False)
class Reference:
    """See module. Everything is in the world frame of the reference scan, metres."""

    views: tuple[EncodedView, ...]
    basis: PcaBasis
    cloud_m: NDArray[np.float32]
    """Object points without outliers, shape (N, 3)."""
    box: OrientedBox
    symmetries: NDArray[np.floating]
    """Rotations about the box's centre that map the object onto itself, identity left out, shape (S, 3, 3)."""
    fingerprint: str
    """The backbone's."""

    def as_arrays(self) -> dict[str, NDArray[Any]]:
        """Plain arrays that hold the whole reference; patches of all views are concatenated."""
        views = self.views
        return {
            "fingerprint": np.array(self.fingerprint),
            "counts": np.array([len(view.cells) for view in views]),
            "grid": np.array([view.grid for view in views]),
            "window": np.array([[view.window.x0, view.window.y0, view.window.size] for view in views]),
            "cells": np.concatenate([view.cells for view in views]),
            "descriptors": np.concatenate([view.descriptors for view in views]).astype(np.float16),
            "points_m": np.concatenate([view.points_m for view in views]),
            "saliency": np.stack([view.saliency for view in views]).astype(np.float16),
            "cls": np.stack([view.cls for view in views]),
            "K": np.stack([view.camera.K for view in views if view.camera]),
            "world_from_camera": np.stack([view.camera.world_from_camera for view in views if view.camera]),
            "basis_mean": self.basis.mean,
            "basis_components": self.basis.components,
            "basis_explained": self.basis.explained,
            "cloud_m": self.cloud_m,
            "world_from_object": self.box.world_from_object,
            "extent_m": self.box.extent_m,
            "symmetries": self.symmetries,
        }

    @staticmethod
    def from_arrays(arrays: Mapping[str, NDArray[Any]]) -> Reference:
        """The inverse of `as_arrays` (descriptors in half precision)."""
        splits = np.cumsum(arrays["counts"])[:-1]
        cells, points = np.split(arrays["cells"], splits), np.split(arrays["points_m"], splits)
        descriptors = np.split(arrays["descriptors"].astype(np.float32), splits)
        views = tuple(
            EncodedView(
                int(arrays["grid"][index]),
                Window(*(int(value) for value in arrays["window"][index])),
                cells[index],
                descriptors[index],
                points[index],
                arrays["saliency"][index].astype(np.float32),
                arrays["cls"][index],
                Camera(arrays["K"][index], arrays["world_from_camera"][index]),
            )
            for index in range(len(arrays["counts"]))
        )
        basis = PcaBasis(arrays["basis_mean"], arrays["basis_components"], arrays["basis_explained"])
        box = OrientedBox(arrays["world_from_object"], arrays["extent_m"])
        return Reference(views, basis, arrays["cloud_m"], box, arrays["symmetries"], str(arrays["fingerprint"]))


def build_reference(encoded: EncodedBurst) -> Reference:
    """From one scan. Raises TooFewViews, or NoObject where too few points have measured depth."""
    shown = [view for view in encoded.views if view.trusted.any()]
    if len(shown) < MIN_VIEWS:
        raise TooFewViews("views", f"a reference needs at least {MIN_VIEWS} views that show the object with depth and camera, found {len(shown)}")
    cloud = remove_outliers(encoded.cloud_m).astype(np.float32)
    basis = PcaBasis.fit(np.concatenate([view.descriptors for view in encoded.views]))
    return Reference(encoded.views, basis, cloud, oriented_box(cloud), np.zeros((0, 3, 3)), encoded.fingerprint)
