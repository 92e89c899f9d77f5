"""Killed at any moment, a memory opens again with everything whole, and answers as before."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import pytest

from core.encode import EncodedBurst
from core.reference import Reference
from core.views import Burst
from store.memory import Memory

ROOT = Path(__file__).parents[2]
KILLS = 20
STEPS = ("learn", "join", "split", "learn", "join", "forget", "rename", "merge", "delete", "undo", "bring")
"""Each finds in the memory what it needs from those before."""
LONGEST_S = 0.05
"""A step takes some hundredths of a second; where the machine is busy, a kill falls into it all the more surely."""


class Workers:
    """Processes that work on a memory, forked from one that has everything imported."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._to: IO[str] = process.stdin
        self._from: IO[str] = process.stdout

    def ask(self, *words: object) -> str:
        """The answer to one line."""
        self._to.write(" ".join(str(word) for word in words) + "\n")
        self._to.flush()
        return self._from.readline().strip()

    def look(self, memory: Path, source: Path) -> dict[str, Any] | None:
        """What a restart finds, None where not everything is whole."""
        found = self.ask("look", memory, source)
        if found == "looked":
            return None
        assert self._from.readline().strip() == "looked"
        return json.loads(found)


@pytest.fixture
def workers() -> Iterator[Workers]:
    """Ready to work."""
    command = [sys.executable, str(Path(__file__).with_name("crash_worker.py"))]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as process:
        yield Workers(process)
        process.stdin.close()


@pytest.fixture
def source(tmp_path: Path, reference: Reference, burst: Burst, encoded: EncodedBurst) -> Path:
    """What the workers learn from, and an archive of two categories."""
    with Memory.open(tmp_path / "source" / "memory") as memory:
        memory.require_backbone("colour", "fingerprint-a")
        for name in ("imported-1", "imported-2"):
            memory.categories.create(reference, burst, encoded, name=name)
        memory.export(tmp_path / "source" / "archive.zip")
    return tmp_path / "source"


def entries(journal: Path) -> list[tuple[str, dict[str, Any]]]:
    lines = journal.read_text().split("\n")[:-1] if journal.exists() else []
    return [tuple(json.loads(line)) for line in lines]


def fits(expected: dict[str, Any], found: dict[str, Any]) -> bool:
    """Whether every category has the instances that it should have, and answers as it did where nothing touched it."""
    return expected.keys() == found.keys() and all(
        instances == found[name][0] and similarity in (None, found[name][1]) for name, (instances, similarity) in expected.items()
    )


def test_twenty_kills_leave_no_half_category(workers: Workers, source: Path, tmp_path: Path) -> None:
    memory, journal = tmp_path / "memory", tmp_path / "journal"
    moments = random.Random(5)
    before: dict[str, Any] = {}
    version, outcomes = 0, Counter()
    for round_ in range(KILLS):
        journal.unlink(missing_ok=True)
        pid = int(workers.ask("work", memory, source, journal, round_))
        steps = moments.randrange(4) if round_ % 4 else 0  # each fourth is killed while it opens, the others in or after a step
        while len(begun_or_done := entries(journal)) < 2 * steps and "failed" not in dict(begun_or_done):
            time.sleep(0.001)
        time.sleep(moments.uniform(0, LONGEST_S))
        os.kill(pid, signal.SIGKILL)
        workers.ask("wait", pid)
        told = entries(journal)
        done = [known for mark, known in told if mark == "done"]
        sure = done[-1] if done else before
        begun = told[-1][1] if told and told[-1][0] == "begin" else None
        assert "failed" not in dict(told), told[-1]
        found = workers.look(memory, source)
        assert found is not None, f"kill {round_}: the memory is not whole"
        after, known = begun is not None and fits(begun, found["known"]), found["known"]
        assert after or fits(sure, known), f"kill {round_}: {known} is neither {sure} nor {begun}"
        outcomes[(begun is not None, after)] += 1
        assert found["version"] >= version
        before, version = known, found["version"]
    assert outcomes[(True, False)] + outcomes[(True, True)] >= KILLS // 4, "hardly any kill fell into a step"


def test_a_kill_at_each_commit_and_folder_of_each_step_leaves_before_or_after(workers: Workers, source: Path, tmp_path: Path) -> None:
    memory, journal = tmp_path / "memory", tmp_path / "journal"
    seed, kills = 0, Counter()
    for step in STEPS:
        for moment in range(1, 100):
            journal.unlink(missing_ok=True)
            seed += 1
            ended = workers.ask("die", memory, source, journal, seed, step, moment)
            told = entries(journal)
            assert "failed" not in dict(told), told[-1]
            assert "begin" in dict(told), f"{step} was not possible"
            found = workers.look(memory, source)
            assert found is not None, f"{step}, moment {moment}: the memory is not whole"
            (_, before), (_, expected), *rest = told
            assert fits(expected, found["known"]) or (not rest and fits(before, found["known"])), f"{step}, moment {moment}: {found}"
            if ended == "ended 0":
                assert rest, told
                break
            kills[step] += 1
    least = {"learn": 16, "join": 4, "split": 2, "forget": 1, "rename": 1, "merge": 1, "delete": 1, "undo": 1, "bring": 3}
    assert all(kills[step] >= count for step, count in least.items()), kills
