"""Soak: a few robots that live with a service for long, while its memory stays as large as it is; does the process grow?"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.crowd import FATES, Errand, Record, Sample, crowd
from benchmarks.load import recorded, taught_service
from benchmarks.load_plot import plot_soak
from benchmarks.parallel import bar
from benchmarks.tables import print_table, write_json
from clients.asynchronous import AsyncRobotClient
from core.errors import InvalidInput
from core.views import Burst

OBSERVE, LEARN = 0.85, 0.93
"""Of the errands: up to the first observes, up to the second learns a category and forgets it again, the rest looks through the memory."""
SETTLED = 1 / 3
"""Of the time: until then allocators and caches fill."""
PART = 1 / 6
"""Of the time, whose least memory is compared at either end of the rest: what stays while no large request is under way."""
SETTINGS = {"ONELOOK_KEEP_OBSERVATIONS": "50", "ONELOOK_UNDO_DAYS": "0"}
"""So that what is kept is bounded soon, as a service of years is."""
SAMPLES_OF_A_RUN = 600
"""Of memory and queue, evenly over the time."""


@dataclass(frozen=True)
class SoakResult:
    """One soak."""

    minutes: float
    robots: int
    answered: int
    refused: int
    failed: int
    early_mb: float
    """The least resident memory of the part after it has settled."""
    late_mb: float
    """The least of the last part."""
    growth: float
    """Share of the first by which the second is larger."""


def run(
    json: Path | None,
    plot: Path | None,
    *,
    minutes: float,
    most_growth: float,
    robots: int,
    views: int,
    data: Path | None,
    url: str | None,
    seed: int,
) -> SoakResult:
    """Prints one line; raises InvalidInput where anything failed or the process grew by more than the share `most_growth`.

    The service is that of `load.taught_service`.
    """
    sequences, bursts = recorded(data, views)
    with taught_service(url, sequences, SETTINGS) as address:
        record = _soak(address, robots, 60 * minutes, living(bursts), seed)
    result = soak_result(minutes, robots, record)
    if json is not None:
        write_json(json, {"benchmark": "soak", "seed": seed, **asdict(result)}, [asdict(sample) for sample in record.samples])
    if plot is not None:
        plot_soak(
            plot, record, f"{robots} robots, {minutes:g} minutes: {result.early_mb:.0f} MB once settled, {result.late_mb:.0f} MB at the end"
        )
    print_table("Soak", [asdict(result)], list(asdict(result)))
    if failed := record.of("failed"):
        raise InvalidInput("failed", f"{len(failed)} errands failed, the first with: {failed[0].why}")
    if result.growth > most_growth:
        raise InvalidInput("growth", f"the process grew by {100 * result.growth:.1f} %, {100 * most_growth:.1f} % are allowed")
    return result


def _soak(url: str, robots: int, seconds: float, errand: Errand, seed: int) -> Record:
    with bar() as progress:
        task = progress.add_task("soaking", total=seconds)

        def tell(record: Record) -> None:
            progress.update(task, completed=min(seconds, record.samples[-1].time_s))

        return asyncio.run(crowd(url, robots, seconds, errand, seed=seed, sample_s=seconds / SAMPLES_OF_A_RUN, tell=tell))


def soak_result(minutes: float, robots: int, record: Record) -> SoakResult:
    """Compares the time after it settled with the end."""
    end = record.samples[-1].time_s
    early = _least(record.samples, SETTLED * end, (SETTLED + PART) * end)
    late = _least(record.samples, (1 - PART) * end, end)
    answered, refused, failed = (len(record.of(fate)) for fate in FATES)
    return SoakResult(minutes, robots, answered, refused, failed, early, late, late / early - 1)


def _least(samples: Sequence[Sample], begin_s: float, end_s: float) -> float:
    return min(sample.resident_mb for sample in samples if begin_s <= sample.time_s <= end_s)


def living(bursts: Sequence[Burst]) -> Errand:
    """Mostly looks; now and then learns a category and forgets it, or looks through what is there."""

    async def errand(robot: AsyncRobotClient, rng: np.random.Generator) -> None:
        burst, chance = bursts[int(rng.integers(len(bursts)))], rng.random()
        if chance < OBSERVE:
            await robot.observe(burst, learn=False)
        elif chance < LEARN:
            scan = await robot.scan(burst)
            for view in burst.views:
                await scan.add(view)
            await robot.forget((await scan.complete("passing")).id)
        else:
            (latest,) = await robot.observations(limit=1)
            await robot.picture(f"/v1/observations/{latest.id}/foreground.png")
            await robot.categories()

    return errand
