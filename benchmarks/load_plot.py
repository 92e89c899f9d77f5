"""The pictures of load and soak."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from benchmarks.crowd import FATES
from benchmarks.pictures import save

if TYPE_CHECKING:
    from benchmarks.crowd import Record
    from benchmarks.load import LoadRow

SIZE = (12, 3.8)
HEADROOM = 1.35
"""Above the curves, for what they mean."""


def plot_load(file: Path, rows: Sequence[LoadRow], title: str) -> None:
    """Against the number of robots: what is answered and refused a second, how long an answer takes, queue and memory."""
    figure = Figure(SIZE, layout="constrained")
    rate, times, inside = figure.subplots(1, 3)
    robots = [row.robots for row in rows]
    took = [row.answered / row.per_s if row.per_s else float("nan") for row in rows]
    rate.plot(robots, [row.per_s for row in rows], "o-", label="answered")
    rate.plot(robots, [row.refused / seconds for row, seconds in zip(rows, took)], "o--", label="refused (503, told when to come back)")
    rate.plot(robots, [row.failed / seconds for row, seconds in zip(rows, took)], "x:", color="tab:red", label="failed")
    rate.set(ylabel="observations a second")
    for name in ("p50_s", "p95_s", "p99_s"):
        times.plot(robots, [getattr(row, name) for row in rows], "o-", label=name.removesuffix("_s"))
    times.set(ylabel="seconds to an answer")
    inside.plot(robots, [row.waiting_mean for row in rows], "o-", label="waiting, mean")
    inside.plot(robots, [row.waiting_max for row in rows], "o--", label="waiting, most")
    inside.set(ylabel="requests")
    memory = inside.twinx()
    memory.plot(robots, [row.resident_mb for row in rows], "s-", color="tab:green", label="resident memory")
    memory.set(ylabel="MB", ylim=(0, 1.25 * max(row.resident_mb for row in rows)))
    for panel in (rate, times, inside):
        panel.set_xscale("log", base=2)
        panel.set_xticks(robots, [str(each) for each in robots])
        panel.set(xlabel="robots at once", ylim=(0, HEADROOM * panel.get_ylim()[1]))
        panel.legend(fontsize=8, loc="upper left")
    memory.legend(fontsize=8, loc="lower right")
    save(figure, file, title)


def plot_soak(file: Path, record: Record, title: str) -> None:
    """Resident memory over time, and what was answered in each part of it."""
    figure = Figure(SIZE, layout="constrained")
    memory, answers = figure.subplots(1, 2)
    memory.plot([sample.time_s / 60 for sample in record.samples], [sample.resident_mb for sample in record.samples])
    memory.set(xlabel="minutes", ylabel="resident memory, MB", ylim=(0, None))
    answered = record.of("answered")
    answers.plot([each.ended_s / 60 for each in answered], [each.seconds for each in answered], ".", markersize=3, label="answered")
    for fate, colour in zip(FATES[1:], ("tab:orange", "tab:red")):
        others = record.of(fate)
        answers.plot(
            [each.ended_s / 60 for each in others], [each.seconds for each in others], "x", color=colour, label=f"{fate} ({len(others)})"
        )
    answers.set(xlabel="minutes", ylabel="seconds of an errand", ylim=(0, None))
    answers.legend(fontsize=8)
    save(figure, file, title)
