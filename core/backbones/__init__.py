"""Backbones by name: each file here that has `OFFERS` adds its own; those of the DINO family load from any folder besides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from core.backbones.base import Backbone, Load, Report
from core.errors import Unavailable
from core.offers import Offers

if TYPE_CHECKING:
    import torch

EMBEDDED = "dinov2-s14"
"""The one whose weights can always be fetched, and that what ships was measured with."""
BACKBONES: Offers[Load] = Offers(__name__)


def load_backbone(
    name: str = EMBEDDED, *, device: str = "cpu", dtype: torch.dtype | None = None, report: Report = lambda message: None
) -> Backbone:
    """One of BACKBONES, or of the DINO family by its folder in the hub's layout, or by its hub name.

    Args:
        dtype: of the products; the fastest that the device has where left out. Tokens of different ones can be compared.
        report: told in one line what is being waited for.

    Raises Unavailable, naming the remedy, where there is no such backbone, or its weights are not there and cannot be fetched.
    """
    if name in BACKBONES:
        return BACKBONES[name](device=device, dtype=dtype, report=report)
    if "/" not in name and not Path(name).is_dir():
        raise Unavailable(f"there is no backbone {name!r}: take one of {', '.join(BACKBONES)}, or a folder or hub name of the DINO family")
    from core.backbones.dino import load

    try:
        return load(name, name, device=device, dtype=dtype)
    except Unavailable as error:
        raise Unavailable(f"{error}, or take one of {', '.join(BACKBONES)}") from error
