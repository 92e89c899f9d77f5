"""Tokens that an earlier version kept of a burst, as those that decisions compare now.

Letters: V views, D token size.
"""

from __future__ import annotations

import numpy as np

from core.evidence import merged
from store.arrays import parts_from_blob, parts_to_blob


def parts_from_patches(blob: bytes, views: int, dim: int, parts: int) -> bytes:
    """So many parts of each of V = `views` views, as of `parts_to_blob`, from patches that were drawn at random, tokens of size D = `dim`.

    Raises ValueError where these are not tokens of so many views, or not finite.
    """
    patches = parts_from_blob(blob, views, dim)
    if not patches.size or not np.isfinite(patches).all():
        raise ValueError("patches are not finite")
    return parts_to_blob(np.stack([merged(view, parts) for view in patches]))
