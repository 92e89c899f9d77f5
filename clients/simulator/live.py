"""An episode in the terminal: one row an encounter as it happens, then the summary."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.summary import ACC_DEG, Spread, Summary
from clients.simulator.teacher import Lesson, TeachingSummary

STAGES = {"find": "find", "features": "features", "points": "features", "decide": "decide"}
"""The service's stages, by the column they are added up in; all others are part of the pose."""
COLUMNS = ("find", "features", "decide", "pose")
TIMED, WIDE = 88, 120
"""Characters a line from which there is room for the time of an answer, and for that of every stage."""
STYLES = {
    Verdict.NEW: "cyan",
    Verdict.RECOGNISED: "green",
    Verdict.FALSE_NOVEL: "bold red",
    Verdict.FALSE_KNOWN: "bold red",
    Verdict.UNDECIDED: "yellow",
}


def show(encounters: Iterable[Encounter], total: int, console: Console) -> list[Encounter]:
    """Runs through the encounters, a row for each as it is over; returns them.

    Rows are printed and not redrawn, so that a long episode scrolls and a log file gets the same table.
    """
    stages = COLUMNS if console.width >= WIDE else ("total",) if console.width >= TIMED else ()
    console.print(_row(stages, header=True))
    done: list[Encounter] = []
    with console.status(f"1 of {total}") as status:
        for encounter in encounters:
            done.append(encounter)
            console.print(_row(stages, encounter))
            if encounter.failure:
                console.print(Text(f"    {encounter.failure}", style="red"))
            status.update(f"{min(len(done) + 1, total)} of {total}")
    console.print()
    return done


def summary_table(summary: Summary) -> Table:
    """The figures of an episode."""
    return _facts("Summary", summary_rows(summary))


def _facts(title: str, rows: Sequence[tuple[str, str, str]]) -> Table:
    table = Table(title=title, title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim")
    table.add_column(justify="right", style="bold")
    table.add_column(style="dim")
    for row in rows:
        table.add_row(*row)
    return table


def lesson_line(lesson: Lesson) -> Text:
    """One thing that the teacher did."""
    if lesson.action == "teach":
        done = (
            Text(f"taught from {lesson.name}", style="cyan")
            if lesson.right
            else Text(f"could not be taught: {lesson.failure}", style="red")
        )
    else:
        answer = f"answered {lesson.answer or 'that it does not know'}"
        wrong = f"{answer}, corrected" if lesson.corrected else f"gave no answer: {lesson.failure}"
        done = Text(answer, style="green") if lesson.right else Text(wrong, style="red")
    accuracy = "" if lesson.accuracy is None else f"  {100 * lesson.accuracy:.0f} % right lately"
    return Text.assemble(f"{lesson.number:>4}  {lesson.known:>3} known  {lesson.name:<22} ", done, (accuracy, "dim"))


def teaching_table(summary: TeachingSummary) -> Table:
    """What the protocol reports."""
    rows = [
        ("categories learnt", str(summary.categories_learnt), f"of {summary.categories_taught} taught; ended: {summary.ended}"),
        ("questions asked", str(summary.questions), f"{summary.corrections} of the answers corrected"),
        ("right answers", f"{summary.accuracy:.0f} %", f"{summary.last_accuracy:.0f} % of the last ones"),
        ("bursts a category", f"{summary.instances_a_category:.1f}", "in the memory at the end"),
    ]
    return _facts("Teaching", rows)


def summary_rows(summary: Summary) -> list[tuple[str, str, str]]:
    """(what, figure, of what) for people."""
    rows = [
        ("objects met", str(summary.objects), f"of {summary.kinds} kinds"),
        ("categories learnt", str(summary.categories), "each from one object"),
        ("correctly recognised", str(summary.correct_known), f"of {summary.met_again} whose category was in the memory"),
        (
            "false novel",
            _share(summary.false_novel, summary.false_novel_rate),
            f"of {summary.met_again}: known categories taken for new ones",
        ),
        (
            "false known",
            _share(summary.false_known, summary.false_known_rate),
            f"of {summary.objects}: taken for a category of another kind",
        ),
    ]
    if summary.undecided:
        rows.append(("undecided", str(summary.undecided), "more views were asked for"))
    for limit, value in zip(ACC_DEG, (summary.acc30, summary.acc15, summary.acc7_5)):
        if value is not None:
            rows.append((f"Acc{limit:g}", f"{value:.0f} %", f"of the recognised are at most {limit:g}° from the truth"))
    if summary.median_deg is not None:
        rows.append(("median rotation error", f"{summary.median_deg:.1f}°", ""))
    if summary.waypoints is not None:
        rows.extend(_waypoint_rows(summary.waypoints))
    rows.append(("time to an answer", f"{summary.observe_ms / 1e3:.1f} s", "median"))
    if summary.scan_ms is not None:
        rows.append(("time to a category", f"{summary.scan_ms / 1e3:.1f} s", "median, from the scan's first view"))
    if summary.motion_s:
        rows.append(("arm in motion", f"{summary.motion_s / 60:.1f} min", f"simulated; {summary.refused} viewpoints were out of reach"))
    rows.append(("this run", f"{summary.total_s:.0f} s", ""))
    return rows


def _waypoint_rows(spread: Spread) -> list[tuple[str, str, str]]:
    rows = [
        (
            "waypoints",
            str(spread.visited),
            f"of one view each; {spread.without_pose} gave no pose, {spread.out_of_reach} more were out of reach",
        )
    ]
    if spread.median_deg is not None:
        rows.append(("rotation there", f"{spread.median_deg:.1f}°", f"median error; {spread.worst_deg:.1f}° the worst"))
    if spread.median_translation is not None and spread.worst_translation is not None:
        worst = f"{100 * spread.worst_translation:.0f} % the worst"
        rows.append(("centre there", f"{100 * spread.median_translation:.0f} %", f"of the diagonal off, median; {worst}"))
    return rows


def _share(count: int, rate: float | None) -> str:
    return str(count) if rate is None else f"{count} ({rate:.0f} %)"


def stage_ms(encounter: Encounter) -> dict[str, float]:
    """The service's milliseconds, added up in those of COLUMNS that took place."""
    added: dict[str, float] = {}
    for stage, milliseconds in encounter.timings_ms.items():
        if stage != "total":
            column = STAGES.get(stage, "pose")
            added[column] = added.get(column, 0.0) + milliseconds
    return added


def _row(stages: Sequence[str], encounter: Encounter | None = None, *, header: bool = False) -> Table:
    """A table of one row, or of the headings; all have the same widths."""
    table = Table(box=None, show_header=header, pad_edge=False, padding=(0, 1, 0, 0), header_style="dim")
    table.add_column("#", justify="right", width=4)
    for heading, width in (("object", 18), ("decision", 24)):
        table.add_column(heading, width=width, no_wrap=True)
    table.add_column("similarity", justify="right", width=14)
    table.add_column("rotation", justify="right", width=8)
    for stage in stages:
        table.add_column(f"{stage} ms", justify="right", width=max(7, len(stage) + 3), style="dim")
    table.add_column("scan s", justify="right", width=6, style="dim")
    if encounter is not None:
        table.add_row(*_cells(encounter, stages))
    return table


def _cells(encounter: Encounter, stages: Sequence[str]) -> list[Text | str]:
    spent = {**stage_ms(encounter), "total": encounter.timings_ms["total"]}
    times = [f"{spent[stage]:.0f}" if stage in spent else "" for stage in stages]
    scan = "" if encounter.scan_ms is None else f"{encounter.scan_ms / 1e3:.1f}"
    return [encounter.label, _name(encounter), _decision(encounter), similarity(encounter), _rotation(encounter), *times, scan]


def _name(encounter: Encounter) -> str:
    """The instance's alone, where that says the category: there is little room."""
    instance = encounter.name.rpartition("/")[2]
    return instance if instance.startswith(encounter.category) else encounter.name


def _decision(encounter: Encounter) -> Text:
    words = {
        Verdict.NEW: "novel → learnt",
        Verdict.RECOGNISED: f"known → {encounter.kind}",
        Verdict.FALSE_NOVEL: "FALSE NOVEL",
        Verdict.FALSE_KNOWN: f"FALSE KNOWN → {encounter.kind}",
        Verdict.UNDECIDED: "uncertain",
    }
    return Text(words[encounter.verdict], style=STYLES[encounter.verdict])


def similarity(encounter: Encounter) -> str:
    """The best similarity against the threshold."""
    best, threshold = encounter.similarity, encounter.threshold
    if best is None or threshold is None:
        return "memory empty"
    return f"{best:.3f} {'>' if best > threshold else '≤'} {threshold:.3f}"


def _rotation(encounter: Encounter) -> Text:
    if encounter.error is None:
        return Text("")
    degrees = encounter.error.rotation_deg
    return Text(f"{degrees:.1f}°", style="green" if degrees <= ACC_DEG[0] else "bold red")
