"""Several threads share one memory: what they do is whole, and what they read is consistent."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np

from core.encode import EncodedBurst
from core.errors import Conflict, InvalidInput, NotFound
from core.reference import Reference
from core.views import Burst
from store.memory import Memory
from store.observations import Joins
from store.retention import Retention
from tests.store.conftest import KNOWN

STEPS = 12


def test_threads_do_not_tear_each_other(folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst, tmp_path: Path) -> None:
    with Memory.open(folder, Retention(observations=5)) as memory:
        for _ in range(3):
            memory.categories.create(reference, burst, encoded)

        def any_category(rng: random.Random) -> str:
            return rng.choice(memory.categories.all()).id

        def look(rng: random.Random) -> None:
            joins = Joins(any_category(rng), encoded, 0.5, "decision")
            memory.observations.create(KNOWN, burst, {"a": np.arange(9)}, joins=joins)

        def learn(rng: random.Random) -> None:
            memory.categories.create(reference, burst, encoded)

        def merge(rng: random.Random) -> None:
            memory.categories.merge(any_category(rng), any_category(rng))

        def undo(rng: random.Random) -> None:
            memory.undo(rng.choice(memory.audit.latest(5)).id)

        def read(rng: random.Random) -> None:
            known = {category.id for category in memory.categories.all()}
            assert len(memory.instances.members()) >= 3
            memory.categories.reference(known.pop())

        def back_up(rng: random.Random) -> None:
            assert memory.backup(tmp_path / f"backup-{rng.random()}").damages == ()

        def work(step: int) -> None:
            rng = random.Random(step)
            for _ in range(STEPS):
                with suppress(Conflict, NotFound, InvalidInput):  # another thread was first
                    rng.choices([look, learn, merge, undo, read, back_up], weights=[4, 2, 2, 2, 4, 1])[0](rng)

        with ThreadPoolExecutor(4) as threads:
            list(threads.map(work, range(4)))
        assert memory.check().ok
        assert memory.sizes().instances == len(memory.instances.members())
        assert memory.sizes().observations <= 5
    for copy in tmp_path.glob("backup-*"):
        with Memory.open(copy) as opened:
            assert opened.check().ok
