"""Load: 1 to 32 robots that observe at once; what is answered, how fast, what is refused, and what it takes in memory."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.crowd import Errand, Record, crowd, require_loopback
from benchmarks.load_plot import plot_load
from benchmarks.pairs import ViewCounts, require_views
from benchmarks.parallel import bar
from benchmarks.tables import report
from clients.asynchronous import AsyncRobotClient
from clients.datasets import folders
from clients.datasets.samples import data_or_samples
from clients.datasets.sources import find_sequences
from clients.robot import RobotClient
from clients.simulator.local_service import local_service
from core.views import Burst

LEARNT = 3
"""Categories that the service knows before, so that most observations pass every stage."""
TAUGHT_VIEWS = 8
"""Of a category, at most."""
WARM_UP_S = 2.0
"""Of one robot alone, not counted."""


@dataclass(frozen=True)
class LoadRow:
    """So many robots at once."""

    robots: int
    answered: int
    per_s: float
    """Observations answered a second."""
    p50_s: float
    p95_s: float
    p99_s: float
    """From sending an observation to its answer; of the answered ones."""
    refused: int
    """503 with Retry-After, which the robots heeded."""
    failed: int
    waiting_mean: float
    waiting_max: float
    """Requests in the queue."""
    resident_mb: float
    """Of the service, at most."""
    cpu_s: float
    """Processor time of the service's process for an answer; on a cluster, of the memory's owner alone."""


def run(
    json: Path | None,
    plot: Path | None,
    *,
    robots: Sequence[int],
    seconds: float,
    views: int,
    data: Path | None,
    url: str | None,
    seed: int,
) -> list[LoadRow]:
    """A row for each number of robots; prints a table.

    The service is that of `taught_service`; raises InvalidInput for one on another machine, or for more views than were recorded.
    """
    sequences, bursts = recorded(data, views)
    with taught_service(url, sequences, {}) as address:
        errand = observing(bursts)
        rows = [load_row(count, seconds, record) for count, record in _levels(address, robots, seconds, errand, seed)]
    meta = {"benchmark": "load", "seconds": seconds, "views": views, "seed": seed}
    report(f"Load, {views} views an observation, {seconds:.0f} s each", rows, meta, json)
    if plot is not None:
        plot_load(plot, rows, f"{views} views an observation, {seconds:.0f} s each")
    return rows


def _levels(url: str, robots: Sequence[int], seconds: float, errand: Errand, seed: int) -> list[tuple[int, Record]]:
    found = []
    with bar() as progress:
        task = progress.add_task("robots", total=len(robots) * seconds)
        asyncio.run(crowd(url, 1, WARM_UP_S, errand, seed=seed, tell=lambda record: None))
        for index, count in enumerate(robots):
            progress.update(task, description=f"{count} robots")

            def tell(record: Record, before: float = index * seconds) -> None:
                progress.update(task, completed=before + min(seconds, record.samples[-1].time_s))

            found.append((count, asyncio.run(crowd(url, count, seconds, errand, seed=seed, tell=tell))))
    return found


def load_row(robots: int, seconds: float, record: Record) -> LoadRow:
    """What a crowd lived through in one line; the rate is over the time until the last one ended its errand."""
    answered = [attempt.seconds for attempt in record.of("answered")]
    p50, p95, p99 = np.percentile(answered, (50, 95, 99)).tolist() if answered else (float("nan"),) * 3
    took = max([seconds, *(attempt.ended_s for attempt in record.attempts)])
    waiting = [sample.waiting for sample in record.samples]
    return LoadRow(
        robots,
        len(answered),
        len(answered) / took,
        p50,
        p95,
        p99,
        len(record.of("refused")),
        len(record.of("failed")),
        float(np.mean(waiting)),
        max(waiting),
        max(sample.resident_mb for sample in record.samples),
        (record.samples[-1].cpu_s - record.samples[0].cpu_s) / max(1, len(answered)),
    )


@contextmanager
def taught_service(url: str | None, sequences: Sequence[folders.Sequence], settings: Mapping[str, str]) -> Iterator[str]:
    """The address of a service that knows some categories: the one at `url` on this machine, or else one of its own, with these settings.

    Raises InvalidInput for a service on another machine.
    """
    with ExitStack() as open_:
        if url is None:
            folder = Path(open_.enter_context(TemporaryDirectory()))
            url = open_.enter_context(local_service(folder / "memory", folder / "log", settings))
        require_loopback(url)
        for group in list(folders.by_category(list(sequences)).values())[:LEARNT]:
            teach(url, group[0], TAUGHT_VIEWS)
        yield url


def recorded(data: Path | None, views: int) -> tuple[list[folders.Sequence], list[Burst]]:
    """The sequences of `data`, the samples where None, and the first views of each. Raises InvalidInput for more than were recorded."""
    sequences = find_sequences(data_or_samples(data))
    require_views(sequences, [ViewCounts.parse(str(views))])
    return sequences, [folders.load_burst(each, range(views)) for each in sequences]


def teach(url: str, sequence: folders.Sequence, most_views: int | None = None) -> str:
    """Makes a category of an object, of its first views where they are limited; returns the category's id."""
    burst = folders.load_burst(sequence, range(len(sequence.images))[:most_views])
    with RobotClient(url) as robot:
        scan = robot.scan(burst)
        for view in burst.views:
            scan.add(view)
        return scan.complete(sequence.category).id


def observing(bursts: Sequence[Burst]) -> Errand:
    """Looks at one of these, and learns nothing from it."""

    async def errand(robot: AsyncRobotClient, rng: np.random.Generator) -> None:
        await robot.observe(bursts[int(rng.integers(len(bursts)))], learn=False)

    return errand
