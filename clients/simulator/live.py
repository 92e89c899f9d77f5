"""An episode in the terminal: one row an encounter as it happens, then the summary."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from clients.simulator.episode import ACC_DEG, Encounter, Summary, Verdict

STAGES = {"find": "find", "features": "features", "points": "features", "decide": "decide"}
"""The service's stages, by the column they are added up in; all others are part of the pose."""
COLUMNS = ("find", "features", "decide", "pose")
WIDE = 120
"""Characters a line from which there is room for every stage."""
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
    stages = COLUMNS if console.width >= WIDE else ("total",)
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
    table = Table(title="Summary", title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim")
    table.add_column(justify="right", style="bold")
    table.add_column(style="dim")
    for row in summary_rows(summary):
        table.add_row(*row)
    return table


def summary_rows(summary: Summary) -> list[tuple[str, str, str]]:
    """(what, figure, of what) for people."""
    rows = [
        ("objects met", str(summary.objects), f"of {summary.kinds} kinds"),
        ("categories learnt", str(summary.categories), "each from one object"),
        ("correctly recognised", str(summary.correct_known), f"of {summary.met_again} whose category was in the memory"),
        ("false novel", str(summary.false_novel), "known categories taken for new ones"),
        ("false known", str(summary.false_known), "taken for a category of another kind"),
    ]
    if summary.undecided:
        rows.append(("undecided", str(summary.undecided), "more views were asked for"))
    if summary.acc30 is not None:
        rows.append((f"Acc{ACC_DEG:.0f}", f"{summary.acc30:.0f} %", f"of the recognised are at most {ACC_DEG:.0f}° from the truth"))
    if summary.median_deg is not None:
        rows.append(("median rotation error", f"{summary.median_deg:.1f}°", ""))
    rows.append(("time to an answer", f"{summary.observe_ms / 1e3:.1f} s", "median"))
    if summary.scan_ms is not None:
        rows.append(("time to a category", f"{summary.scan_ms / 1e3:.1f} s", "median, from the scan's first view"))
    rows.append(("whole episode", f"{summary.total_s:.0f} s", ""))
    return rows


def stage_ms(encounter: Encounter) -> dict[str, float]:
    """The service's milliseconds, added up in those of COLUMNS that took place."""
    added: dict[str, float] = {}
    for stage, milliseconds in encounter.observation.timings_ms.items():
        if stage != "total":
            column = STAGES.get(stage, "pose")
            added[column] = added.get(column, 0.0) + milliseconds
    return added


def _row(stages: Sequence[str], encounter: Encounter | None = None, *, header: bool = False) -> Table:
    """A table of one row, or of the headings; all have the same widths."""
    table = Table(box=None, show_header=header, pad_edge=False, padding=(0, 1, 0, 0), header_style="dim")
    table.add_column("#", justify="right", width=3)
    for heading, width in (("object", 22), ("decision", 22)):
        table.add_column(heading, width=width, no_wrap=True)
    table.add_column("similarity", justify="right", width=13)
    table.add_column("rotation", justify="right", width=8)
    for stage in stages:
        table.add_column(f"{stage} ms", justify="right", width=max(7, len(stage) + 3), style="dim")
    table.add_column("scan s", justify="right", width=6, style="dim")
    if encounter is not None:
        table.add_row(*_cells(encounter, stages))
    return table


def _cells(encounter: Encounter, stages: Sequence[str]) -> list[Text | str]:
    spent = {**stage_ms(encounter), "total": encounter.observation.timings_ms["total"]}
    times = [f"{spent[stage]:.0f}" if stage in spent else "" for stage in stages]
    scan = "" if encounter.scan_ms is None else f"{encounter.scan_ms / 1e3:.1f}"
    return [str(encounter.number), encounter.sequence.name, _decision(encounter), similarity(encounter), _rotation(encounter), *times, scan]


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
    observation = encounter.observation
    if not observation.similarities or observation.threshold is None:
        return "memory empty"
    best = observation.similarities[0].similarity
    return f"{best:.3f} {'>' if best > observation.threshold else '≤'} {observation.threshold:.3f}"


def _rotation(encounter: Encounter) -> Text:
    if encounter.error is None:
        return Text("")
    degrees = encounter.error.rotation_deg
    return Text(f"{degrees:.1f}°", style="green" if degrees <= ACC_DEG else "bold red")
