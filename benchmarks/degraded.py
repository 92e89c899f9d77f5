"""Degraded bursts, encoded once and kept in the user's cache by what they show."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.encoded import encoder_key, read_encoded, write_encoded
from benchmarks.isolation import found_mask
from clients.datasets import folders
from core.backbones.base import Backbone, Features
from core.backbones.weights import cache_folder
from core.encode import Encoder
from core.views import Burst, View


class Remembering:
    """A backbone that looks at a picture once: where depth and cameras get worse, pictures stay."""

    def __init__(self, backbone: Backbone) -> None:
        self.inner = backbone
        self._seen: dict[bytes, Features] = {}
        self.name, self.patch_size, self.dim = backbone.name, backbone.patch_size, backbone.dim
        self.has_saliency, self.whitening, self.fingerprint = backbone.has_saliency, backbone.whitening, backbone.fingerprint

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """See `Backbone`."""
        keys = [hashlib.sha256(f"{image.shape}".encode() + image.tobytes()).digest() for image in images]
        new = {key: index for index, key in enumerate(keys) if key not in self._seen}
        if new:
            features = self.inner.extract(images[list(new.values())])
            self._seen |= {key: features.part(slice(place, place + 1)) for place, key in enumerate(new)}
        return Features.joined([self._seen[key] for key in keys])


def masked_views(sequence: folders.Sequence, encoded: Path, indices: Sequence[int]) -> list[View]:
    """The views with the object's silhouette, as the data have it or else as the product finds it in the undegraded view.

    A view in which nothing is found counts as object in its middle.
    """
    views = folders.load_burst(sequence, indices, masks=True).views
    found = [read_encoded(encoded).views[index] for index in indices]
    return [
        view if view.mask is not None else replace(view, mask=_something(found_mask(each, *view.size)))
        for view, each in zip(views, found, strict=True)
    ]


def encode_degraded(views: Sequence[View], encoder: Encoder) -> Path:
    """The cached file of a burst's encoding, by the product's own crop; silhouettes are left out. Raises NoObject."""
    burst = Burst([replace(view, mask=None) for view in views])
    file = cache_folder() / "degraded" / f"{_key(burst, encoder)}.npz"
    if not file.exists():
        write_encoded(file, encoder.encode(burst))
    return file


def _something(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    if not mask.any():
        height, width = mask.shape
        mask[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3] = True
    return mask


def _key(burst: Burst, encoder: Encoder) -> str:
    digest = hashlib.sha256(encoder_key(encoder).encode())
    for view in burst.views:
        arrays = [view.rgb, view.depth_m]
        if view.camera is not None:
            arrays += [view.camera.K, view.camera.world_from_camera]
        for array in arrays:
            digest.update(b"none" if array is None else f"{array.dtype} {array.shape}".encode() + array.tobytes())
    return digest.hexdigest()[:32]
