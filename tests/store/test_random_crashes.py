"""Crashed at random calls, again and again, a memory opens with all that was acknowledged and with nothing half done.

Each step changes the memory and a model of what should be in it. A crash within a step leaves the folder as the dead process did, or as a
power cut does, which takes back what was never synced. The memory that opens then holds what the model says before the step or after it.
"""

from __future__ import annotations

import json
import zipfile
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import precondition, rule, run_state_machine_as_test

from core.encode import EncodedBurst
from core.reference import Reference
from core.scan import ScanRequest
from core.sim3 import Sim3
from core.views import Burst
from store.memory import Memory
from store.observations import Answer, Joins
from store.requests import Reply
from tests.store.crash_model import Material
from tests.store.crashing import KEPT, Crashing

LEAST_CRASHES = 200
EXAMPLES, STEPS = 20, 30
MOST_ROUNDS = 8
"""Of so many examples: where crashes fall is left to chance, and short steps are seldom hit."""
MOST_CATEGORIES = 5
DONE = Reply(201, "application/json", b"{}")

crashes = st.tuples(st.integers(0, 3), st.integers(0, 999), st.booleans(), st.integers(0, 3))
"""No crash where the first is 0; where in the step; whether it is a power cut; a crash of the restart too where the last is 0."""


class Steps(Crashing):
    """What is done to a memory."""

    def pick(self, which: int, among: list[Any]) -> Any:
        return among[which % len(among)]

    def begin(self, label: int) -> str:
        request = ScanRequest(np.zeros(3), np.array([0.0, 0, 1]), float(label), np.stack([np.eye(4)] * 2), 0.2)
        return self.memory.scans.create(request).id

    def open_scans(self) -> list[int]:
        return [label for label, (state, _) in self.known.scans.items() if state in ("requested", "collecting")]

    def several(self) -> list[str]:
        return [name for name, about in self.known.categories.items() if len(about["instances"]) > 1]

    @rule(crash=crashes)
    def begin_a_scan_once(self, crash: Any) -> None:
        label, after = self.next_label(), deepcopy(self.known)
        after.scans[label] = ("requested", 0)

        def ask() -> None:
            with self.memory.requests.once(f"key-{label}", "/v1/scans", "digest") as once:
                if once.earlier is None:
                    self.begin(label)
                    once.reply = DONE

        self.step("begin a scan", ask, after, crash, undoable=None, again=ask)

    @precondition(lambda self: self.open_scans())
    @rule(which=st.integers(0, 99), crash=crashes)
    def add_views(self, which: int, crash: Any) -> None:
        label = self.pick(which, self.open_scans())
        after, scan_id = deepcopy(self.known), self.scan_id(label)
        after.scans[label] = ("collecting", after.scans[label][1] + len(self.material.burst))
        self.step("add views", lambda: self.memory.scans.add(scan_id, self.material.burst), after, crash, undoable=None)

    @precondition(lambda self: self.open_scans() and len(self.known.categories) < MOST_CATEGORIES)
    @rule(which=st.integers(0, 99), crash=crashes)
    def learn(self, which: int, crash: Any) -> None:
        scan, label = self.pick(which, self.open_scans()), self.next_label()
        after, scan_id, name = deepcopy(self.known), self.scan_id(scan), f"kind-{label}"
        after.scans[scan] = ("completed", 0)
        after.categories[name] = {"instances": [label], "goals": []}
        m = self.material
        learn = lambda: self.memory.categories.create(m.reference, m.burst, m.tokens(label), name=name, scan_id=scan_id)  # noqa: E731
        self.step("learn", learn, after, crash)

    @precondition(lambda self: self.known.scans)
    @rule(which=st.integers(0, 99), crash=crashes)
    def delete_a_scan(self, which: int, crash: Any) -> None:
        label = self.pick(which, sorted(self.known.scans))
        after, scan_id = deepcopy(self.known), self.scan_id(label)
        del after.scans[label]
        self.step("delete a scan", lambda: self.memory.scans.delete(scan_id), after, crash, undoable=None)

    @rule(which=st.integers(0, 99), joins=st.integers(0, 3), crash=crashes)
    def observe(self, which: int, joins: int, crash: Any) -> None:
        label, after = self.next_label(), deepcopy(self.known)
        after.observations = [*after.observations, str(label)][-KEPT:]
        to = None
        if joins and self.known.categories:
            name = self.pick(which, sorted(self.known.categories))
            after.categories[name]["instances"].append(label)
            to = Joins(self.category_id(name), self.material.tokens(label), 0.5, "decision")
        answer = Answer("known" if to else "novel", to and to.category_id, str(label), None, None, None, None, {})
        keep = lambda: self.memory.observations.create(answer, self.material.burst, {"a": np.arange(9)}, joins=to)  # noqa: E731
        self.step("observe", keep, after, crash)

    @precondition(lambda self: len(self.known.categories) > 1)
    @rule(which=st.integers(0, 99), crash=crashes)
    def merge(self, which: int, crash: Any) -> None:
        names = sorted(self.known.categories)
        gone, into = names[which % len(names)], names[(which + 1) % len(names)]
        after, ids = deepcopy(self.known), (self.category_id(gone), self.category_id(into))
        after.categories[into]["instances"] = sorted(after.categories[into]["instances"] + after.categories.pop(gone)["instances"])
        self.step("merge", lambda: self.memory.categories.merge(*ids), after, crash, undoable=True)

    @precondition(lambda self: self.several())
    @rule(which=st.integers(0, 99), crash=crashes)
    def split(self, which: int, crash: Any) -> None:
        name, part = self.pick(which, sorted(self.several())), f"part-{self.next_label()}"
        after, category_id = deepcopy(self.known), self.category_id(name)
        moved = self.memory.instances.of(category_id)[0].id
        label = self.instance_label(moved)
        after.categories[name]["instances"].remove(label)
        after.categories[part] = {"instances": [label], "goals": []}
        args = category_id, [moved], self.material.reference, self.material.burst
        self.step("split", lambda: self.memory.categories.split(*args, name=part), after, crash, undoable=True)

    @precondition(lambda self: self.several())
    @rule(which=st.integers(0, 99), crash=crashes)
    def forget(self, which: int, crash: Any) -> None:
        name = self.pick(which, sorted(self.several()))
        after, category_id = deepcopy(self.known), self.category_id(name)
        instance_id = self.memory.instances.of(category_id)[-1].id
        after.categories[name]["instances"].remove(self.instance_label(instance_id))
        self.step("forget", lambda: self.memory.instances.forget(category_id, instance_id), after, crash, undoable=True)

    @precondition(lambda self: self.known.categories)
    @rule(which=st.integers(0, 99), crash=crashes)
    def rename(self, which: int, crash: Any) -> None:
        name, new = self.pick(which, sorted(self.known.categories)), f"name-{self.next_label()}"
        after, category_id = deepcopy(self.known), self.category_id(name)
        after.categories[new] = after.categories.pop(name)
        self.step("rename", lambda: self.memory.categories.rename(category_id, new), after, crash, undoable=True)

    @precondition(lambda self: self.known.categories)
    @rule(which=st.integers(0, 99), crash=crashes)
    def delete(self, which: int, crash: Any) -> None:
        name = self.pick(which, sorted(self.known.categories))
        after, category_id = deepcopy(self.known), self.category_id(name)
        del after.categories[name]
        self.step("delete", lambda: self.memory.categories.delete(category_id), after, crash, undoable=True)

    @precondition(lambda self: self.before_change is not None)
    @rule(crash=crashes)
    def undo(self, crash: Any) -> None:
        after, entry = deepcopy(self.known), self.memory.audit.latest(1)[0]
        after.categories = deepcopy(self.before_change)
        self.step("undo", lambda: self.memory.undo(entry.id), after, crash)

    @precondition(lambda self: len(self.known.categories) < MOST_CATEGORIES)
    @rule(crash=crashes)
    def bring(self, crash: Any) -> None:
        origins = {category.origin_id for category in self.memory.categories.all()}
        with zipfile.ZipFile(self.material.archive) as file:
            parts = json.loads(file.read("manifest.json"))["categories"]
        after = deepcopy(self.known)
        after.categories |= {part["name"]: {"instances": [0], "goals": []} for part in parts if part["origin_id"] not in origins}
        if after == self.known or {part["name"] for part in parts} & self.known.categories.keys():
            return
        self.step("import", lambda: self.memory.import_archive(self.material.archive), after, crash)

    @precondition(lambda self: self.known.categories)
    @rule(which=st.integers(0, 99), crash=crashes)
    def show_a_goal(self, which: int, crash: Any) -> None:
        name, goal = self.pick(which, sorted(self.known.categories)), f"goal-{self.next_label()}"
        after, category_id = deepcopy(self.known), self.category_id(name)
        after.categories[name]["goals"] = sorted([*after.categories[name]["goals"], goal])
        self.step("goal", lambda: self.memory.goals.create(category_id, goal, Sim3.identity()), after, crash)

    @rule(prune=st.booleans(), crash=crashes)
    def calibrate_or_prune(self, prune: bool, crash: Any) -> None:
        if prune:
            self.step("prune", self.memory.prune, deepcopy(self.known), crash, undoable=None)
            return
        after = replace(deepcopy(self.known), setting=self.next_label())
        self.step("calibrate", lambda: self.memory.keep_setting("rate", after.setting), after, crash, undoable=None)


@pytest.fixture
def material(tmp_path: Path, reference: Reference, burst: Burst, encoded: EncodedBurst) -> Material:
    found = Material(reference, burst, encoded, tmp_path / "archive.zip")
    with Memory.open(tmp_path / "source") as memory:
        memory.require_backbone("colour", "fingerprint-a")
        for name in ("imported-1", "imported-2"):
            memory.categories.create(reference, burst, found.tokens(0), name=name)
        memory.export(found.archive)
    return found


def test_two_hundred_crashes_lose_nothing_that_was_acknowledged(material: Material, tmp_path: Path) -> None:
    class Here(Steps):
        parent = tmp_path

    Here.material, Here.crashed = material, Counter()
    how = settings(
        max_examples=EXAMPLES,
        stateful_step_count=STEPS,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
        print_blob=False,
    )
    steps = {"begin a scan", "add views", "learn", "observe", "merge", "split", "forget", "rename", "delete", "undo", "import", "open"}
    for number in range(MOST_ROUNDS):
        run_state_machine_as_test(seed(number)(Here), settings=how)
        if sum(Here.crashed.values()) >= LEAST_CRASHES and steps <= Here.crashed.keys():
            break
    assert sum(Here.crashed.values()) >= LEAST_CRASHES, Here.crashed
    assert not steps - Here.crashed.keys(), f"no crash fell into {steps - Here.crashed.keys()}"
