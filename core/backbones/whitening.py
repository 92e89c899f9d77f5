"""Whitening of tokens: what all images share is taken out, so that what is left tells categories apart.

Letters: N tokens, D token size; * is any batch shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.views import FloatArray

SHRINKAGE = 3.0
"""Isotropic variance added, in units of the mean variance: directions of little variance are not blown up."""
STATISTICS = Path(__file__).parent / "statistics"


@dataclass(frozen=True, eq=False)
class Whitening:
    """An affine map of tokens to coordinates of about equal variance."""

    mean: FloatArray
    """Shape (D,)."""
    matrix: FloatArray
    """Symmetric, shape (D, D)."""

    @staticmethod
    def fit(tokens: FloatArray) -> Whitening:
        """From patch tokens of many images, shape (N, D)."""
        mean = tokens.mean(axis=0, dtype=np.float64)
        centred = tokens - mean
        variances, vectors = np.linalg.eigh(centred.T @ centred / len(tokens))
        scaled = vectors / np.sqrt(variances.clip(0) + SHRINKAGE * variances.mean())
        return Whitening(mean.astype(np.float32), (scaled @ vectors.T).astype(np.float32))

    @staticmethod
    def shipped(name: str) -> Whitening | None:
        """The estimate that comes with a backbone, where there is one (see `benchmarks/token_statistics.py`)."""
        file = STATISTICS / f"{name}.npz"
        if not file.exists():
            return None
        with np.load(file, allow_pickle=False) as arrays:
            return Whitening(arrays["mean"].astype(np.float32), arrays["matrix"].astype(np.float32))

    def save(self, name: str, folder: Path) -> Path:
        """Writes what `shipped` reads."""
        file = folder / f"{name}.npz"
        file.parent.mkdir(parents=True, exist_ok=True)  # a hub's names have folders
        np.savez_compressed(file, mean=self.mean.astype(np.float32), matrix=self.matrix.astype(np.float16))
        return file

    def apply(self, tokens: FloatArray) -> FloatArray:
        """Whitened tokens, shape (*, D)."""
        return (tokens - self.mean) @ self.matrix
