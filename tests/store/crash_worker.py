"""Works on a memory until it is killed; run by test_crash.py.

Reads lines `work MEMORY SOURCE JOURNAL SEED`, `wait PROCESS`, `die MEMORY SOURCE JOURNAL SEED STEP MOMENT` and `look MEMORY SOURCE`;
works, dies and looks in processes forked from this one, which has everything imported. SOURCE holds `memory`, of which the reference, its
views and tokens are taken, and `archive.zip`. Before each step the journal gets what the memory should hold after it, and a mark when it
is done.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import traceback
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from core.encode import EncodedBurst
from core.novelty import DecisionConfig, decide
from core.reference import Reference
from core.views import Burst
from store.memory import Memory
from store.observations import Answer, Joins
from store.scans import ScanRequest
from tests.store.crash_model import require_whole

MOST_CATEGORIES = 6
Known = dict[str, list[Any]]
"""By name of a category: its number of instances, and its similarity to one burst, None where that is not told beforehand."""


def state(memory: Memory, asked: EncodedBurst) -> Known:
    """What the memory knows and how it answers."""
    names = {category.id: category for category in memory.categories.all()}
    found = decide(memory.instances.members(), asked, DecisionConfig("pooled_best_view")).similarities
    return {str(names[each].name): [names[each].instances, similarity] for each, similarity in found}


class Worker:
    """One process's steps; its random numbers decide which."""

    def __init__(self, memory: Memory, source: Path, journal: Path, seed: int) -> None:
        self._memory = memory
        self._archive = source / "archive.zip"
        self._journal = os.open(journal, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        self._seed = seed
        self._random = random.Random(seed)
        self.reference, self.burst, self.encoded = material(source)
        self._made = 0

    def run(self) -> None:
        """Steps without end."""
        steps = [self.learn, self.learn, self.join, self.merge, self.split, self.forget, self.rename, self.delete, self.undo, self.bring]
        self._tell("done", state(self._memory, self.encoded))
        while True:
            categories = self._memory.categories.all()
            self._do(self.delete if len(categories) > MOST_CATEGORIES else self._random.choice(steps))

    def die(self, step: str, moment: int) -> None:
        """One step, and death at its so manieth moment: after a folder got its name, before a commit, before a folder is removed."""
        left = [moment]

        def tick() -> None:
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), signal.SIGKILL)

        rename, rmtree = Path.rename, shutil.rmtree
        Path.rename = lambda *args: (rename(*args), tick())[0]
        shutil.rmtree = lambda *args, **options: (tick(), rmtree(*args, **options))[1]
        self._memory._connection._db.conn.set_trace_callback(lambda sql: tick() if sql == "COMMIT" else None)
        self._tell("done", state(self._memory, self.encoded))
        self._do(getattr(self, step))

    def _do(self, step: Callable[[Known], tuple[Known, Callable[[], object]] | None]) -> None:
        work = step(state(self._memory, self.encoded))
        if work is not None:
            expected, change = work
            self._tell("begin", expected)
            change()
            self._tell("done", state(self._memory, self.encoded))

    def learn(self, known: Known) -> tuple[Known, Callable[[], object]]:
        name = self._new_name()

        def change() -> None:
            request = ScanRequest(np.zeros(3), np.array([0.0, 0, 1]), 1.0, np.stack([np.eye(4)] * 2), 0.2)
            scan = self._memory.scans.create(request)
            self._memory.scans.add(scan.id, self.burst)
            self._memory.scans.add(scan.id, self.burst.select([0]))
            self._memory.categories.create(self.reference, self.burst, self._tokens(), name=name, scan_id=scan.id)

        return known | {name: [1, None]}, change

    def join(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        if not known:
            return None
        name = self._random.choice(sorted(known))
        joins = Joins(self._id(name), self._tokens(), 0.5, "decision")
        answer = Answer("known", joins.category_id, None, None, None, None, None, {})
        arrays = {"a": np.arange(1000)}
        return known | {name: [known[name][0] + 1, None]}, lambda: self._memory.observations.create(answer, self.burst, arrays, joins=joins)

    def merge(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        if len(known) < 2:
            return None
        gone, into = self._random.sample(sorted(known), 2)
        left = {name: each for name, each in known.items() if name != gone}
        ids = self._id(gone), self._id(into)
        return left | {into: [known[gone][0] + known[into][0], None]}, lambda: self._memory.categories.merge(*ids)

    def split(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        several = sorted(name for name, (instances, _) in known.items() if instances > 1)
        if not several:
            return None
        name, part = self._random.choice(several), self._new_name()
        category_id = self._id(name)
        moved = [self._memory.instances.of(category_id)[0].id]
        expected = known | {name: [known[name][0] - 1, None], part: [1, None]}
        return expected, lambda: self._memory.categories.split(category_id, moved, self.reference, self.burst, name=part)

    def forget(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        several = sorted(name for name, (instances, _) in known.items() if instances > 1)
        if not several:
            return None
        name = self._random.choice(several)
        category_id = self._id(name)
        instance_id = self._memory.instances.of(category_id)[-1].id
        return known | {name: [known[name][0] - 1, None]}, lambda: self._memory.instances.forget(category_id, instance_id)

    def rename(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        if not known:
            return None
        name, new = self._random.choice(sorted(known)), self._new_name()
        category_id = self._id(name)
        expected = {new if each == name else each: about for each, about in known.items()}
        return expected, lambda: self._memory.categories.rename(category_id, new)

    def delete(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        if not known:
            return None
        name = self._random.choice(sorted(known))
        category_id = self._id(name)
        return {each: about for each, about in known.items() if each != name}, lambda: self._memory.categories.delete(category_id)

    def undo(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        entry = self._memory.audit.latest(1)[0]
        if not entry.undoable or entry.action != "delete":
            return None
        name, instances = entry.before["name"], entry.before["instances"]
        return known | {name: [instances, None]}, lambda: self._memory.undo(entry.id)

    def bring(self, known: Known) -> tuple[Known, Callable[[], object]] | None:
        origins = {category.origin_id for category in self._memory.categories.all()}
        new = {name: [1, None] for name, origin in archived(self._archive).items() if origin not in origins}
        if new.keys() & known.keys():
            return None
        return known | new, lambda: self._memory.import_archive(self._archive)

    def _id(self, name: str) -> str:
        return next(category.id for category in self._memory.categories.all() if category.name == name)

    def _new_name(self) -> str:
        self._made += 1
        return f"{self._seed}-{self._made}"

    def _tokens(self) -> EncodedBurst:
        """Other tokens each time, so that each instance answers in its own way."""
        rng = np.random.default_rng(self._random.randrange(2**32))
        views = tuple(replace(view, pooled=rng.normal(size=len(view.pooled)).astype(np.float32)) for view in self.encoded.views)
        return EncodedBurst(views, self.encoded.fingerprint)

    def _tell(self, mark: str, known: Known) -> None:
        os.write(self._journal, (json.dumps([mark, known]) + "\n").encode())


def material(source: Path) -> tuple[Reference, Burst, EncodedBurst]:
    """Of the category in `source`."""
    with Memory.reading(source / "memory") as memory:
        category = memory.categories.all()[0]
        reference = memory.categories.reference(category.id)
        burst = Burst([memory.categories.view(category.id, index) for index in range(category.views)])
    return reference, burst, EncodedBurst(reference.views, reference.fingerprint)


def archived(archive: Path) -> dict[str, str]:
    """Origin by name of what an archive holds."""
    with zipfile.ZipFile(archive) as file:
        return {part["name"]: part["origin_id"] for part in json.loads(file.read("manifest.json"))["categories"]}


def look(folder: Path, source: Path) -> dict[str, Any]:
    """What a restart finds: everything whole, nothing left over, and what it knows."""
    with Memory.open(folder) as memory:
        require_whole(memory)
        return {"version": memory.version, "known": state(memory, material(source)[2])}


def start(work: Callable[[], object]) -> int:
    """The id of a process that does it and ends."""
    pid = os.fork()
    if pid == 0:
        try:
            work()
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(0)
    return pid


def work(memory: Path, source: Path, journal: Path, seed: int, step: str | None = None, moment: int = 0) -> None:
    """Works until it is killed, or does one step until its moment; leaves a mark where it ends in another way."""
    try:
        with Memory.open(memory) as opened:
            worker = Worker(opened, source, journal, seed)
            worker.run() if step is None else worker.die(step, moment)
    except BaseException:
        with journal.open("a") as marks:
            marks.write(json.dumps(["failed", traceback.format_exc()]) + "\n")


def answer(text: str) -> None:
    """One line to whoever started this."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> None:
    """Answers `work` with the id of the process, `wait` and `die` when it has ended, `look` with what was found."""
    for line in sys.stdin:
        verb, *words = line.split()
        if verb == "wait":
            os.waitpid(int(words[0]), 0)
            answer("gone")
        elif verb == "look":
            os.waitpid(start(lambda: answer(json.dumps(look(Path(words[0]), Path(words[1]))))), 0)  # noqa: B023
            answer("looked")
        else:
            memory, source, journal = (Path(each) for each in words[:3])
            how = (words[4], int(words[5])) if verb == "die" else ()
            pid = start(lambda: work(memory, source, journal, int(words[3]), *how))  # noqa: B023
            answer(str(pid) if verb == "work" else f"ended {os.waitpid(pid, 0)[1]}")


if __name__ == "__main__":
    main()
