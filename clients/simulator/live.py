"""An episode in the terminal: one row an encounter as it happens, then the summary."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from clients.simulator.episode import ACC_DEG, Encounter, Summary, Verdict

STAGES = {"find": "find", "features": "features", "points": "features", "decide": "decide"}
"""The service's stages, by the column they are added up in; all others are part of the pose."""
COLUMNS = ("find", "features", "decide", "pose")
STYLES = {
    Verdict.NEW: "cyan",
    Verdict.RECOGNISED: "green",
    Verdict.FALSE_NOVEL: "bold red",
    Verdict.FALSE_KNOWN: "bold red",
    Verdict.UNDECIDED: "yellow",
}


def show(encounters: Iterable[Encounter], total: int, console: Console) -> list[Encounter]:
    """Runs through the encounters with a table that grows; returns them."""
    table = _table()
    done: list[Encounter] = []
    with Live(table, console=console, refresh_per_second=4) if console.is_terminal else nullcontext() as live:
        for encounter in encounters:
            done.append(encounter)
            table.add_row(*_cells(encounter))
            if live is None:
                console.print(f"{encounter.number}/{total} {encounter.sequence.name}: {_decision(encounter).plain}")
            else:
                table.caption = f"{len(done)} of {total} objects"
    if not console.is_terminal:
        console.print(table)
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
    """The service's milliseconds, added up in COLUMNS."""
    added = dict.fromkeys(COLUMNS, 0.0)
    for stage, milliseconds in encounter.observation.timings_ms.items():
        if stage != "total":
            added[STAGES.get(stage, "pose")] += milliseconds
    return added


def _table() -> Table:
    table = Table(title="Encounters", title_justify="left", caption_justify="left", header_style="dim", pad_edge=False)
    table.add_column("#", justify="right")
    table.add_column("object")
    table.add_column("decision")
    table.add_column("similarity", justify="right")
    table.add_column("rotation\nerror", justify="right")
    for stage in COLUMNS:
        table.add_column(f"{stage}\nms", justify="right", style="dim")
    table.add_column("scan\ns", justify="right", style="dim")
    return table


def _cells(encounter: Encounter) -> list[Text | str]:
    stages = stage_ms(encounter)
    scan = "" if encounter.scan_ms is None else f"{encounter.scan_ms / 1e3:.1f}"
    times = [f"{stages[column]:.0f}" if stages[column] else "" for column in COLUMNS]
    return [str(encounter.number), encounter.sequence.name, _decision(encounter), similarity(encounter), _rotation(encounter), *times, scan]


def _decision(encounter: Encounter) -> Text:
    words = {
        Verdict.NEW: "novel → learnt",
        Verdict.RECOGNISED: f"known → {encounter.kind}",
        Verdict.FALSE_NOVEL: "FALSE NOVEL → learnt again",
        Verdict.FALSE_KNOWN: f"FALSE KNOWN → {encounter.kind}",
        Verdict.UNDECIDED: "uncertain",
    }
    text = Text(words[encounter.verdict], style=STYLES[encounter.verdict])
    if encounter.failure:
        text.append(f"\n{encounter.failure}", style="red")
    return text


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
