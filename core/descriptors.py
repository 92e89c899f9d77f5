"""Descriptors: unit vectors, reduced to the reference's principal components (paper, "Dimensionality reduction").

Letters: N tokens, D token size, C components; * is any batch shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.errors import InvalidInput
from core.views import FloatArray

Float32Array = NDArray[np.float32]
KEPT_COMPONENTS = 64
"""Components kept with a reference; the paper uses 32 and at most 32 are asked for by default."""


@dataclass(frozen=True, eq=False)
class PcaBasis:
    """Principal components of one reference's foreground tokens."""

    mean: Float32Array
    """Shape (D,)."""
    components: Float32Array
    """Orthonormal rows, largest variance first, shape (C, D)."""
    explained: Float32Array
    """Share of the variance along each, shape (C,)."""

    @staticmethod
    def fit(tokens: Float32Array, count: int = KEPT_COMPONENTS) -> PcaBasis:
        """From tokens, shape (N, D); at most min(N, D, count) components, each with the sign that makes its largest entry positive."""
        mean = tokens.mean(axis=0, dtype=np.float64)
        centred = tokens - mean
        variances, vectors = np.linalg.eigh(centred.T @ centred / max(len(tokens) - 1, 1))
        kept = min(count, len(tokens), tokens.shape[1])
        components = vectors[:, ::-1][:, :kept].T
        signs = np.sign(components[np.arange(kept), np.abs(components).argmax(axis=1)])
        explained = variances[::-1][:kept].clip(0) / max(float(variances.sum()), 1e-12)
        return PcaBasis(mean.astype(np.float32), (components * signs[:, None]).astype(np.float32), explained.astype(np.float32))

    def project(self, tokens: Float32Array, count: int | None = None) -> Float32Array:
        """Coordinates along the first `count` components, shape (N, C), not normalised."""
        return (tokens - self.mean) @ self.components[:count].T


def unit(vectors: FloatArray) -> Float32Array:
    """Vectors, shape (*, D), scaled to length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12), dtype=np.float32)


def component_count(dims: int | None, token_size: int) -> int | None:
    """`dims`, or None where that means whole tokens. Raises InvalidInput for more components than a reference keeps."""
    if dims is None or dims == token_size:
        return None
    if dims > KEPT_COMPONENTS:
        raise InvalidInput("dims", f"expected 1 to {KEPT_COMPONENTS}, or {token_size} for whole tokens, found {dims}")
    return dims
