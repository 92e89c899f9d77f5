"""The memory as a whole, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from core.calibration import LARGEST_RATE
from service import upkeep
from service.agent import Agent
from service.schemas.categories import Category
from service.schemas.fields import CreatedAt, FalseKnownRate, Score, Threshold
from service.settings import SMALLEST_RATE
from store import backup, records


class MemoryInfo(BaseModel):
    """What a memory holds, what it was made with, and how it decides."""

    version: int = Field(description="Grows with each change.", examples=[42])
    backbone: str | None = Field(examples=["dinov2-s14"])
    fingerprint: str | None = Field(description="Of the backbone's weights, layer and preprocessing.")
    score: Score
    threshold: Threshold
    false_known_rate: FalseKnownRate
    categories: int
    instances: int = Field(description="Bursts assigned to categories.")
    observations: int = Field(description="Kept ones.")
    scans: int = Field(description="In progress.")
    goals: int
    size_bytes: int = Field(description="On disk, with what can still be undone.")

    @staticmethod
    def of(agent: Agent) -> MemoryInfo:
        """As it is now."""
        sizes = agent.memory.sizes()
        return MemoryInfo(
            version=agent.memory.version,
            backbone=agent.memory.backbone,
            fingerprint=agent.memory.fingerprint,
            score=agent.config.score,
            threshold=agent.config.threshold,
            false_known_rate=agent.upkeep.false_known_rate,
            categories=sizes.categories,
            instances=sizes.instances,
            observations=sizes.observations,
            scans=sizes.scans,
            goals=sizes.goals,
            size_bytes=sizes.size,
        )


class Calibrate(BaseModel):
    """How often the memory may be wrong."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"false_known_rate": 0.02}})

    false_known_rate: float | None = Field(
        ge=SMALLEST_RATE,
        le=LARGEST_RATE,
        description="Of objects of no known category, the share that may be called known; null: ONELOOK_FALSE_KNOWN_RATE.",
    )


class Thresholds(BaseModel):
    """What the decision asks for at present; each decision moves it a little."""

    false_known_rate: float
    tokens: float = Field(description="Least similarity of a known object, of bursts without depth or cameras.")
    verified: float = Field(description="The same of bursts whose poses could be tried.")
    decisions: int = Field(description="Of this memory, that they are made of beside the shipped ones.")

    @staticmethod
    def of(found: upkeep.Thresholds) -> Thresholds:
        """From the agent's answer."""
        return Thresholds(false_known_rate=found.false_known_rate, tokens=found.tokens, verified=found.verified, decisions=found.decisions)


class Backup(BaseModel):
    """A copy that opens as a memory."""

    folder: str = Field(description="On the service's machine.")
    files: int
    size_bytes: int
    damages: list[str] = Field(description="What is damaged in the memory, and so in its copy.")

    @staticmethod
    def of(made: backup.Backup) -> Backup:
        """From the memory's answer."""
        damages = [f"{damage.file}: {damage.problem}; {damage.consequence}" for damage in made.damages]
        return Backup(folder=str(made.folder), files=made.files, size_bytes=made.size, damages=damages)


class ExportQuery(BaseModel):
    """Which categories."""

    model_config = ConfigDict(extra="forbid")

    category_id: list[str] = Field([], max_length=1000, description="May be given several times; all categories where left out.")


class Import(BaseModel):
    """What an archive brought."""

    entry_id: str = Field(description="Of the audit trail.")
    categories: list[Category] = Field(description="New ones, under ids of this memory.")
    duplicates: list[Category] = Field(description="Those that the memory had already: left as they are.")
    same_name: list[str] = Field(description="Names of new ones that other categories have, too.")

    @staticmethod
    def of(agent: Agent, entry_id: str, ids: Sequence[str], duplicate_ids: Sequence[str]) -> Import:
        """From ids of categories; those deleted since are left out."""
        known = {category.id: category for category in agent.memory.categories.all()}
        names = [category.name for category in known.values() if category.name is not None]
        new = [Category.of(known[each]) for each in ids if each in known]
        return Import(
            entry_id=entry_id,
            categories=new,
            duplicates=[Category.of(known[each]) for each in duplicate_ids if each in known],
            same_name=sorted({category.name for category in new if category.name is not None and names.count(category.name) > 1}),
        )


class AuditEntry(BaseModel):
    """One change of what was learnt."""

    id: str
    created_at: CreatedAt
    actor: str | None = Field(description="Who asked for it: the name of their key where there are keys, and what X-Actor said.")
    action: records.Action
    category_id: str | None = Field(description="The category that was changed.")
    before: dict[str, Any] = Field(description="How it was, as far as it changed.")
    after: dict[str, Any] = Field(description="How it was then.")
    undone_by: str | None = Field(description="The entry that undid it.")
    undoable: bool = Field(description="Whether it can still be undone.")

    @staticmethod
    def of(entry: records.AuditEntry) -> AuditEntry:
        """From the memory's record."""
        return AuditEntry(**{name: getattr(entry, name) for name in AuditEntry.model_fields})


class AuditList(BaseModel):
    """The latest changes, newest first."""

    entries: list[AuditEntry]
