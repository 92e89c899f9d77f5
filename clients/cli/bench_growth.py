"""What `onelook bench growth` asks of a store: filled with categories that are tokens only, and decided on in a process of its own."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from benchmarks.growth import GrowthRow, Probe
    from core.encode import EncodedBurst
    from core.novelty import Decision
    from store.memory import Memory

T = TypeVar("T")
AT_ONCE = 500
"""Categories in one transaction, and members compared in one go."""
PAST = 300
"""Decisions that the memory has behind it: as many as the service calibrates by."""
MEGABYTE = 1e6


def fill(folder: Path, bursts: Iterable[EncodedBurst]) -> None:
    """Adds a category for each burst; a new memory gets a past too."""
    from store.memory import Memory

    with Memory.open(folder) as memory:
        if not memory.categories.all():
            _live_through(memory)
    for several in _several(bursts):
        _insert(folder, several)


def measure(probe: Probe) -> GrowthRow:
    """In a process of its own, so that what is resident is this memory's."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_measure, probe).result()


def _measure(probe: Probe) -> GrowthRow:
    import numpy as np

    from benchmarks.growth import GrowthRow
    from store.memory import Memory

    decide = partial(_decide, probe.whitening)
    with TemporaryDirectory() as folder, Memory.open(Path(folder)) as empty:  # loads what any decision needs
        _insert(Path(folder), [probe.novel])
        decide(empty, probe.novel)
    resident, read = _resident_mb(), _read_mb()
    opening, memory = _timed(lambda: Memory.open(probe.folder))
    with memory:
        opened = _read_mb()
        first, _ = _timed(lambda: decide(memory, probe.known[0]))
        first_read = _read_mb()
        fresh = [_timed(partial(decide, memory, burst))[0] for burst in probe.known[1:]]
        again = [_timed(partial(decide, memory, burst)) for burst in probe.known]
        store = [_timed(lambda: (memory.instances.listed(), memory.observations.decisions(PAST)))[0] for _ in probe.known]
        after = _resident_mb()
        categories = len(memory.instances.listed())
        nearest = _nearest_ms(memory, probe)
        answers = _answers(memory, probe, [decision for _, decision in again])
        few = memory.instances.enrolled(probe.whitening).exact
        learnt = _learnt_ms(memory, probe, decide)
    times = [milliseconds for milliseconds, _ in again]
    return GrowthRow(
        categories=categories,
        exact=few,
        decide_ms=float(np.median(times)),
        least_ms=min(times),
        p95_ms=float(np.percentile(times, 95)),
        nearest_ms=nearest,
        store_ms=float(np.median(store)),
        new_ms=float(np.median(fresh)),
        learnt_ms=learnt,
        first_ms=first,
        open_ms=opening,
        open_read_mb=opened - read,
        first_read_mb=first_read - read,
        file_mb=sum(file.stat().st_size for file in probe.folder.glob("memory.sqlite3*")) / MEGABYTE,
        resident_mb=after - resident,
        right=answers.right,
        recall=answers.recall,
        evidence_off=answers.evidence_off,
        exact_spread=answers.exact_spread,
    )


def _decide(whitening: Any, memory: Memory, burst: EncodedBurst) -> Decision:
    from core.novelty import DecisionConfig
    from service.compute import Solver
    from service.judgement import Judge

    return Judge(memory, burst, whitening, Solver()).judge(DecisionConfig()).decision


def _nearest_ms(memory: Memory, probe: Probe) -> float:
    import numpy as np

    from core.enrolled import NEAREST

    near = _nearness(memory)
    return float(np.median([_timed(partial(near.nearest, burst.pooled.mean(axis=0)[None], NEAREST))[0] for burst in probe.known]))


def _learnt_ms(memory: Memory, probe: Probe, decide: Callable[[Memory, EncodedBurst], Decision]) -> float:
    """The category is gone afterwards."""
    _insert(probe.folder, [probe.novel])
    milliseconds, _ = _timed(partial(decide, memory, probe.known[-1]))
    memory.categories.delete(memory.instances.listed()[-1].category_id)
    return milliseconds


@dataclass(frozen=True)
class _Answers:
    """See `GrowthRow`."""

    right: float
    recall: float | None = None
    evidence_off: float | None = None
    exact_spread: float | None = None


def _answers(memory: Memory, probe: Probe, decisions: Sequence[Decision]) -> _Answers:
    import numpy as np

    members = memory.instances.listed()
    found = [decision.similarities[0] for decision in decisions]
    right = float(np.mean([each[0] == members[category].category_id for each, category in zip(found, probe.right)]))
    if not probe.exact:
        return _Answers(right)
    exact = exact_best(memory, probe.known, probe.whitening)
    return _Answers(
        right,
        recall=float(np.mean([each[0] == best[0] for each, best in zip(found, exact)])),
        evidence_off=float(np.mean([abs(each[1] - best[1]) for each, best in zip(found, exact)])),
        exact_spread=float(np.std([similarity for _, similarity in exact])),
    )


def exact_best(memory: Memory, bursts: Sequence[EncodedBurst], whitening: Any) -> list[tuple[str, float]]:
    """The most similar category of each burst and its similarity, with every member compared part by part."""
    from core.calibration import Prior
    from core.enrolled import adapted_from
    from core.evidence import Adaptation, Comparison, match_views, part_tokens, whitened

    members = memory.instances.listed()
    names = [member.id for member in members]

    def tokens(some: Sequence[str]) -> list[Any]:
        parts = memory.instances.parts(some)
        return [whitened(parts[each], whitening) for each in some]

    adaptation = Adaptation.fit(tokens([names[place] for place in adapted_from(len(names))]))

    @cache
    def directions_of(place: int) -> Any:
        return adaptation.directions(tokens([names[place]])[0])

    def of_member(place: int, founders: Sequence[int]) -> list[float]:
        return match_views(directions_of(place), [directions_of(each) for each in founders]).tolist()

    targets = [adaptation.directions(whitened(part_tokens(burst), whitening)) for burst in bursts]
    matches = _matches(targets, (map(adaptation.directions, tokens(some)) for some in _several(names)))
    categories, usual = [member.category_id for member in members], Prior.shipped().usual
    return [Comparison.of(categories, each, of_member, usual).ranked()[0] for each in matches]


def _matches(targets: Sequence[Any], members: Iterable[Iterable[Any]]) -> list[Any]:
    """Of each target with all members, which come several at once."""
    import numpy as np

    from core.evidence import match_views

    found: list[list[Any]] = [[] for _ in targets]
    for directions in map(list, members):
        for target, matches in zip(targets, found):
            matches.append(match_views(target, directions))
    return [np.concatenate(matches) for matches in found]


def _several(values: Iterable[T]) -> Iterator[list[T]]:
    """AT_ONCE of them, and again."""
    left = iter(values)
    while some := list(islice(left, AT_ONCE)):
        yield some


def _nearness(memory: Memory) -> Any:
    from core.nearness import Nearness

    near = Nearness()
    near.update(memory.instances.listed(), memory.instances.pooled_means)
    return near


def _insert(folder: Path, bursts: Sequence[EncodedBurst]) -> None:
    """Categories as the store writes their rows, whose references and pictures are nowhere."""
    from store.connection import Connection, new_id
    from store.instances import insert_instance
    from store.times import now

    connection = Connection(folder)
    try:
        with connection.change() as db:
            for burst in bursts:
                category_id = new_id()
                row = {"id": category_id, "origin_id": category_id, "created_at": now(), "views": len(burst.views)}
                db.table("categories").insert(row | {"extent_m": "[1,1,1]", "reference_sha256": "", "files": "{}"})
                insert_instance(db, category_id, burst, source="scan", source_id=None, how="scan")
    finally:
        connection.close()


def _live_through(memory: Memory) -> None:
    """Decisions to be calibrated by, on an object as small as can be."""
    import numpy as np

    from core.novelty import Decision
    from core.scores import BEST
    from core.views import Burst, View
    from store.observations import Answer

    seen = Burst([View(np.zeros((32, 32, 3), np.uint8))])
    for number in range(PAST):
        similarities = tuple((f"{number:032x}", 0.01 * place) for place in range(5, 0, -1))
        decision = Decision("novel", BEST, 0.2, similarities, 0.1, 0.3, 0.5, rival=0.05)
        memory.observations.create(Answer("novel", None, None, decision, None, None, None, {}), seen, {"none": np.zeros(1)})


def _timed(work: Callable[[], T]) -> tuple[float, T]:
    """Milliseconds, and what came of it."""
    started = time.perf_counter()
    done = work()
    return 1000 * (time.perf_counter() - started), done


def _resident_mb() -> float:
    return _field(Path("/proc/self/status"), "VmRSS:") * 1024 / MEGABYTE


def _read_mb() -> float:
    """Bytes asked of files, also where the system has them in its cache."""
    return _field(Path("/proc/self/io"), "rchar:") / MEGABYTE


def _field(file: Path, name: str) -> int:
    lines: Iterator[str] = (line for line in file.read_text().splitlines() if line.startswith(name))
    return int(next(lines).split()[1])
