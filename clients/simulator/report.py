"""A self-contained page that shows an episode: figures, decisions, and the pictures of every encounter."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from clients.answers import Category, Info
from clients.simulator.episode import ACC_DEG, Encounter, Summary, Verdict
from clients.simulator.live import similarity, stage_ms, summary_rows
from clients.simulator.pictures import Pictures
from clients.simulator.timeline import Timeline

TEMPLATE = "report.html"


@dataclass(frozen=True, eq=False)
class EpisodeRecord:
    """All that a report tells."""

    summary: Summary
    encounters: Sequence[Encounter]
    pictures: Sequence[Pictures]
    """One for each encounter."""
    categories: Sequence[Category]
    """The memory at the end."""
    info: Info
    settings: Mapping[str, object]
    """What the episode was asked for: data, seed, views."""


@dataclass(frozen=True)
class LearntCategory:
    """One row of the table of categories."""

    number: int
    founder: Encounter
    founder_pictures: Pictures
    category: Category
    recognised: Sequence[Encounter]
    """Later encounters that were taken for it."""


def write_report(record: EpisodeRecord, path: Path) -> None:
    """Writes the page; it needs no other file."""
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    page = environment.get_template(TEMPLATE).render(
        record=record,
        rows=summary_rows(record.summary),
        encounters=list(zip(record.encounters, record.pictures, strict=True)),
        learnt=learnt_categories(record),
        timeline=Timeline(record.encounters),
        Verdict=Verdict,
        acc_deg=ACC_DEG,
        similarity=similarity,
        stage_ms=stage_ms,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8")


def learnt_categories(record: EpisodeRecord) -> list[LearntCategory]:
    """The categories in the order they were learnt, as they are at the end."""
    at_end = {category.id: category for category in record.categories}
    founders = [(each, pictures) for each, pictures in zip(record.encounters, record.pictures, strict=True) if each.learnt is not None]
    learnt = []
    for number, (founder, pictures) in enumerate(founders, start=1):
        assert founder.learnt is not None
        category = at_end.get(founder.learnt.id, founder.learnt)
        recognised = [each for each in record.encounters if each.observation.category_id == category.id]
        learnt.append(LearntCategory(number, founder, pictures, category, recognised))
    return learnt


def write_json(record: EpisodeRecord, path: Path) -> None:
    """Writes the figures and one row an encounter, for programs."""
    meta = {**record.settings, "service": asdict(record.info)}
    rows = [_row(encounter) for encounter in record.encounters]
    path.write_text(json.dumps({"meta": meta, "summary": asdict(record.summary), "rows": rows}, indent=1), encoding="utf-8")


def _row(encounter: Encounter) -> dict[str, Any]:
    seen = encounter.observation
    return {
        "number": encounter.number,
        "object": encounter.sequence.name,
        "category": encounter.sequence.category,
        "observation_id": seen.id,
        "outcome": seen.outcome,
        "verdict": encounter.verdict.value,
        "recognised_as": encounter.kind,
        "category_id": encounter.learnt.id if encounter.learnt else seen.category_id,
        "similarity": seen.similarities[0].similarity if seen.similarities else None,
        "threshold": seen.threshold,
        "rotation_error_deg": encounter.error.rotation_deg if encounter.error else None,
        "translation_error": encounter.error.translation if encounter.error else None,
        "log_scale_error": encounter.error.log_scale if encounter.error else None,
        "failure": encounter.failure,
        "observe_ms": encounter.observe_ms,
        "scan_ms": encounter.scan_ms,
        "timings_ms": dict(seen.timings_ms),
    }
