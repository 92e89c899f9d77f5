"""What a memory should hold, as the test of random crashes models it, what one does hold, and whether that is whole."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from core.encode import EncodedBurst
from core.reference import Reference
from core.views import Burst
from store.columns import files_from_json
from store.contents import FOLDERS
from store.folders import sums
from store.memory import Memory


@dataclass
class Known:
    """What the memory should hold, by labels that the steps give: ids are random."""

    categories: dict[str, dict[str, list[Any]]] = field(default_factory=dict)
    scans: dict[int, tuple[str, int]] = field(default_factory=dict)
    observations: list[str] = field(default_factory=list)
    setting: int | None = None


def found(memory: Memory) -> Known:
    """The same, of a memory."""
    names = {category.id: category.name for category in memory.categories.all()}
    known = Known(setting=memory.setting("rate"))
    for category_id, name in names.items():
        assert name not in known.categories
        known.categories[name] = {"instances": [], "goals": sorted(goal.name for goal in memory.goals.of(category_id))}
    for member in memory.instances.members():
        known.categories[names[member.category_id]]["instances"].append(int(member.pooled[0, 0]))
    for about in known.categories.values():
        about["instances"].sort()
    for row in memory._connection.rows("SELECT id FROM scans"):
        scan = memory.scans.get(row["id"])
        known.scans[int(scan.request.radius_m)] = (scan.state, scan.views)
    known.observations = [seen.frame for seen in reversed(memory.observations.latest(100))]
    return known


def require_whole(memory: Memory) -> None:
    """Every file is what was written, every row has its folder and every folder its row."""
    report = memory.check()
    assert report.ok, report.damages
    for category in memory.categories.all():
        assert len(memory.categories.reference(category.id).views) == category.views == len(memory.categories.burst(category.id))
        assert category.instances == len(memory.instances.of(category.id)) > 0
    named = {memory.folder / row["folder"]: row["files"] for query in FOLDERS.values() for row in memory._connection.rows(query)}
    roots = (memory.categories.root, memory.observations.root, *(memory.folder / "scans").glob("*"))
    there = {folder for kind in roots for folder in kind.glob("*")}
    assert there == set(named), there ^ set(named)
    assert all(sums(folder) == files_from_json(files) for folder, files in named.items())


@dataclass(frozen=True, eq=False)
class Material:
    """What is learnt."""

    reference: Reference
    burst: Burst
    encoded: EncodedBurst
    archive: Path

    def tokens(self, label: int) -> EncodedBurst:
        """Tokens that tell their label."""
        views = tuple(replace(view, pooled=np.full_like(view.pooled, label)) for view in self.encoded.views)
        return EncodedBurst(views, self.encoded.fingerprint)
