"""A self-contained page that shows an episode: figures, decisions, charts, and the pictures of what went worst."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from clients.answers.categories import Category
from clients.answers.memory import Info
from clients.simulator import charts
from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.live import similarity, stage_ms, summary_rows
from clients.simulator.pictures import Pictures
from clients.simulator.summary import ACC_DEG, Summary
from clients.simulator.timeline import Timeline

TEMPLATE = "report.html"
ALL_SHOWN = 24
"""Episodes up to this long show the pictures of every encounter; longer ones those of the WORST."""
WORST = 12


@dataclass(frozen=True, eq=False)
class EpisodeRecord:
    """All that a report tells."""

    summary: Summary
    encounters: Sequence[Encounter]
    pictures: Mapping[int, Pictures]
    """By index in `encounters`: of those that are shown, see `shown`."""
    categories: Sequence[Category]
    """The memory at the end."""
    info: Info
    settings: Mapping[str, object]
    """What the episode was asked for: data, seed, views."""


@dataclass(frozen=True)
class LearntCategory:
    """One row of the table of categories."""

    founder: Encounter
    founder_pictures: Pictures | None
    category: Category
    recognised: Sequence[Encounter]
    """Later encounters that were taken for it."""


def shown(encounters: Sequence[Encounter]) -> list[int]:
    """Indices of the encounters whose pictures are shown, in the order of showing."""
    chosen = encounters if len(encounters) <= ALL_SHOWN else charts.worst(encounters, WORST)
    return [list(encounters).index(each) for each in chosen]


def write_report(record: EpisodeRecord, path: Path) -> None:
    """Writes the page; it needs no other file."""
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.get_template(TEMPLATE).render(
        record=record,
        rows=summary_rows(record.summary),
        gallery=[(record.encounters[index], record.pictures[index]) for index in shown(record.encounters)],
        all_shown=len(record.encounters) <= ALL_SHOWN,
        learnt=learnt_categories(record),
        timeline=Timeline(record.encounters),
        confusion=charts.Confusion.of(record.encounters),
        curve=charts.curve(record.encounters),
        histogram=charts.pose_histogram(record.encounters),
        stages=charts.stage_bars(record.encounters),
        Verdict=Verdict,
        acc_deg=ACC_DEG[0],
        similarity=similarity,
        stage_ms=stage_ms,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8")


def learnt_categories(record: EpisodeRecord) -> list[LearntCategory]:
    """The categories in the order they were learnt, as they are at the end; those that are gone since are left out."""
    at_end = {category.id: category for category in record.categories}
    learnt = []
    for index, founder in enumerate(record.encounters):
        category = at_end.get(founder.learnt or "")
        if category is not None:
            recognised = [each for each in record.encounters if each.category_id == category.id]
            learnt.append(LearntCategory(founder, record.pictures.get(index), category, recognised))
    return learnt


def write_json(record: EpisodeRecord, path: Path) -> None:
    """Writes the figures and one row an encounter, for programs."""
    meta = {**record.settings, "service": asdict(record.info)}
    rows = [json.loads(encounter.as_json()) for encounter in record.encounters]
    rates = {"false_novel_rate": record.summary.false_novel_rate, "false_known_rate": record.summary.false_known_rate}
    path.write_text(json.dumps({"meta": meta, "summary": {**asdict(record.summary), **rates}, "rows": rows}, indent=1), encoding="utf-8")
