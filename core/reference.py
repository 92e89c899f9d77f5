"""A reference: what is kept of the one object that a category was learnt from.

Letters: N cloud points, S symmetries.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.boxes import OrientedBox, oriented_box, remove_outliers, remove_support
from core.descriptors import PcaBasis
from core.encode import EncodedBurst, EncodedView
from core.errors import TooFewViews
from core.packing import burst_as_arrays, burst_from_arrays
from core.symmetry import find_symmetries
from core.views import FloatArray

MIN_VIEWS = 2
"""One view shows one side only; no transform to the other sides could be found."""


@dataclass(frozen=True, eq=False)
class Reference:
    """See module. Everything is in the world frame of the reference scan, metres."""

    views: tuple[EncodedView, ...]
    basis: PcaBasis
    cloud_m: NDArray[np.float32]
    """Object points without support and outliers, shape (N, 3)."""
    box: OrientedBox
    symmetries: FloatArray
    """Rotations about the box's centre that map the object onto itself, identity left out, shape (S, 3, 3); see `core.symmetry`."""
    fingerprint: str
    """The backbone's."""

    def as_arrays(self) -> dict[str, NDArray[Any]]:
        """Plain arrays that hold the whole reference."""
        return {
            **burst_as_arrays(EncodedBurst(self.views, self.fingerprint)),
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
        encoded = burst_from_arrays(arrays)
        basis = PcaBasis(arrays["basis_mean"], arrays["basis_components"], arrays["basis_explained"])
        box = OrientedBox(arrays["world_from_object"], arrays["extent_m"])
        return Reference(encoded.views, basis, arrays["cloud_m"], box, arrays["symmetries"], encoded.fingerprint)


def build_reference(encoded: EncodedBurst) -> Reference:
    """From the views of one scan that have a camera. Raises TooFewViews, or NoObject where too few points have measured depth."""
    views = tuple(view for view in encoded.views if view.camera is not None)
    shown = [view for view in views if view.trusted.any()]
    if len(shown) < MIN_VIEWS:
        raise TooFewViews(
            "views", f"a reference needs at least {MIN_VIEWS} views that show the object with depth and camera, found {len(shown)}"
        )
    cameras = np.stack([view.camera.world_from_camera[:3, 3] for view in shown if view.camera is not None])
    cloud = remove_outliers(remove_support(encoded.cloud_m, cameras)).astype(np.float32)
    basis = PcaBasis.fit(np.concatenate([view.descriptors for view in views]))
    box = oriented_box(cloud)
    return Reference(views, basis, cloud, box, find_symmetries(shown, basis, box), encoded.fingerprint)
