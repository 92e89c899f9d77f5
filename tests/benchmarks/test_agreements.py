"""Agreements are computed anew where the code that solves has changed."""

from __future__ import annotations

import re
from pathlib import Path

import core
from benchmarks.agreements import SOURCES
from benchmarks.encoded import SOURCES as ENCODING

BESIDE = {"errors", "clock", "backbones", "affine9", "confidence", "pnp", "solvers", "symmetry"}
"""Serve other variants, 9-D, or what is said of a pose: none of them moves the transform of `best`."""


def test_the_cache_depends_on_every_source_that_poses() -> None:
    root = Path(core.__file__).parent
    sources = {source for pattern in SOURCES for source in root.glob(pattern)}
    encoding = {source.stem for pattern in ENCODING for source in root.glob(pattern)}
    imported = {name for source in sources for name in re.findall(r"^from core\.([a-z0-9_]+)", source.read_text(), re.MULTILINE)}
    assert imported - BESIDE - {"estimators"} <= {source.stem for source in sources} | encoding
