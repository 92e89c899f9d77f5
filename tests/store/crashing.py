"""A memory that crashes within a step and is opened again, held against a model of what it should hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis.stateful import RuleBasedStateMachine

from store.memory import Memory
from store.retention import Retention
from tests.faults import Crash, Disk, tapped
from tests.store.crash_model import Known, Material, found, require_whole

KEPT = 4
"""Observations, so that the oldest are dropped all the time."""
CALLS = {
    "import": 58,
    "observe": 31,
    "split": 29,
    "learn": 29,
    "add views": 27,
    "open": 20,
    "prune": 12,
    "begin a scan": 9,
    "delete a scan": 4,
}
"""That a step takes; others take FEW."""
FEW = 3


class Crashing(RuleBasedStateMachine):
    """A memory and the model of it; each step, and each restart, may crash."""

    material: Material
    parent: Path
    crashed: Counter[str]
    runs = 0

    def __init__(self) -> None:
        super().__init__()
        type(self).runs += 1
        self.label = 0
        self.folders = 0
        self.known = Known()
        self.before_change: dict[str, Any] | None = None
        """Categories as they were before the last change, where that can be undone."""
        self.disk = Disk(self.next_folder())
        self.tap = tapped(self.disk)
        self.tap.__enter__()
        self.memory = self.opened()
        self.memory.import_archive(self.material.archive)
        self.known.categories = {name: {"instances": [0], "goals": []} for name in ("imported-1", "imported-2")}

    def teardown(self) -> None:
        self.tap.__exit__(None, None, None)
        self.memory.close()

    def next_folder(self) -> Path:
        self.folders += 1
        return self.parent / f"{self.runs}-{self.folders}"

    def next_label(self) -> int:
        self.label += 1
        return self.label

    def opened(self) -> Memory:
        return Memory.open(self.disk.root, Retention(observations=KEPT))

    def step(
        self,
        name: str,
        change: Callable[[], object],
        after: Known,
        crash: tuple[int, int, bool, int],
        *,
        undoable: bool | None = False,
        again: Callable[[], object] | None = None,
    ) -> None:
        """One change, and perhaps a crash in it; `again` is what the caller does who got no answer. `undoable` None leaves it."""
        here, where, power_cut, restart = crash
        before = deepcopy(self.known)
        self.disk.arm(1 + where * CALLS.get(name, FEW) // 1000 if here else None)
        try:
            change()
        except Crash:
            self.crashed[name] += 1
            self.restart(power_cut, None if restart else 1 + where % CALLS["open"])
            now = found(self.memory)
            assert now in (before, after), f"{name}, after {self.disk.kinds}"
            require_whole(self.memory)
            done = now == after
            if again is not None:
                again()
                done = True
        else:
            done = True
        if done:
            self.known = after
            if undoable is not None:
                self.before_change = before.categories if undoable else None
        self.disk.arm(None)
        assert found(self.memory) == self.known

    def restart(self, power_cut: bool, crash_at: int | None) -> None:
        """What a dead process left, opened by another one, which may die of it too."""
        dead = self.memory
        self.disk.move(self.disk.left(self.next_folder(), power_cut=power_cut))
        dead.close()
        self.disk.arm(crash_at)
        try:
            self.memory = self.opened()
        except Crash:
            self.crashed["open"] += 1
            self.disk.move(self.disk.left(self.next_folder(), power_cut=power_cut))
            self.memory = self.opened()
        self.disk.arm(None)

    def category_id(self, name: str) -> str:
        return next(category.id for category in self.memory.categories.all() if category.name == name)

    def scan_id(self, label: int) -> str:
        rows = self.memory._connection.rows("SELECT id FROM scans")
        return next(row["id"] for row in rows if int(self.memory.scans.get(row["id"]).request.radius_m) == label)

    def instance_label(self, instance_id: str) -> int:
        (row,) = self.memory._connection.rows("SELECT pooled FROM instances WHERE id = ?", instance_id)
        return int(np.frombuffer(row["pooled"], "<f4")[0])
