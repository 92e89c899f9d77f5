"""The memory as a whole: how readily it calls objects known, backups, and what comes from other memories."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from core.calibration import Calibration, Levels, Prior
from core.errors import Conflict
from core.novelty import Decision
from core.scores import BEST
from service.events import Events
from service.judgement import CALIBRATED_BY
from store.backup import Backup
from store.imports import Import
from store.memory import Memory
from store.records import AuditEntry

RATE = "false_known_rate"
"""Setting of the memory."""


@dataclass(frozen=True)
class Thresholds:
    """What the decision asks for at present; it changes with each decision."""

    false_known_rate: float
    tokens: float
    """Least evidence of a known object, of a burst without depth or cameras."""
    verified: float
    """The same where poses were tried."""
    decisions: int
    """Own decisions that they are made of, beside the shipped ones."""


@dataclass(frozen=True)
class Distribution:
    """The evidence of latest decisions, and what is made of it."""

    calibration: Calibration
    levels: Levels
    rivals: tuple[float, ...]
    """Of own decisions, the evidence of the best wrong category."""
    decisions: tuple[Decision, ...]
    """Newest first."""


class Upkeep:
    """Of one memory."""

    def __init__(self, memory: Memory, events: Events, score: str, threshold: float | None, false_known_rate: float) -> None:
        """Score, threshold and rate are those of the settings."""
        self._memory = memory
        self._events = events
        self._score = score
        self._threshold = threshold
        self._false_known_rate = false_known_rate

    @property
    def false_known_rate(self) -> float:
        """Of objects of no known category, how many may be called known: what the memory was calibrated to, else the setting."""
        kept = self._memory.setting(RATE)
        return self._false_known_rate if kept is None else float(kept)

    def calibrate(self, false_known_rate: float | None, *, actor: str | None = None) -> Thresholds:
        """Keeps a rate with the memory; None goes back to the setting's. Raises Conflict where thresholds are not made of a rate."""
        if self._threshold is not None:
            raise Conflict(f"ONELOOK_THRESHOLD sets the threshold to {self._threshold}; start without it to have it made of a rate")
        if self._score != BEST:
            raise Conflict(f"the score {self._score} has a threshold of its own; ONELOOK_SCORE={BEST} has one that is made of a rate")
        self._memory.keep_setting(RATE, false_known_rate)
        self._memory.note("calibrate", {RATE: false_known_rate}, actor=actor)
        self._events.publish("memory_calibrated", false_known_rate=self.false_known_rate)
        return self.thresholds()

    def thresholds(self) -> Thresholds:
        """As they are now."""
        tokens, verified = self.distributions()
        least = [each.levels.known_above for each in (tokens, verified)]
        return Thresholds(self.false_known_rate, least[0], least[1], len(tokens.rivals) + len(verified.rivals))

    def distributions(self) -> tuple[Distribution, Distribution]:
        """What the thresholds of the score `best` rest on: from tokens alone, and with poses."""
        past = [each for each in self._memory.observations.decisions(CALIBRATED_BY) if each.score == BEST]
        return self._distribution(past, verified=False), self._distribution(past, verified=True)

    def _distribution(self, decisions: Sequence[Decision], *, verified: bool) -> Distribution:
        past = [each for each in decisions if each.verified is verified]
        rivals = tuple(each.rival for each in past if each.rival is not None)
        calibration = Calibration.fit(rivals, Prior.shipped().of(verified))
        return Distribution(calibration, calibration.levels(self.false_known_rate), rivals, tuple(past))

    def backup(self, parent: Path, *, actor: str | None = None) -> Backup:
        """Copies the memory, while it is used, to a new folder in `parent`, called by time and version. Raises Conflict and Unavailable."""
        taken_at = datetime.now(timezone.utc).strftime("%Y%m%dT%H%M%S.%fZ")
        made = self._memory.backup(parent / f"{taken_at}-v{self._memory.version}")
        self._memory.note("backup", {"folder": str(made.folder)}, actor=actor)
        return made

    def export(self, path: Path, category_ids: Sequence[str] | None, *, actor: str | None = None) -> None:
        """Writes categories, all where None, to a file that does not exist yet. Raises NotFound, Conflict and Unavailable."""
        made = self._memory.export(path, category_ids)
        chosen = None if category_ids is None else list(category_ids)
        self._memory.note("export", {"categories": made.categories, "chosen": chosen, "left_out": made.left_out}, actor=actor)

    def import_archive(self, archive: bytes, *, actor: str | None = None) -> Import:
        """Takes in the categories of another memory. Raises InvalidInput and Conflict, and nothing is taken in then."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "memory.zip"
            path.write_bytes(archive)
            brought = self._memory.import_archive(path, actor=actor)
        self._events.publish("memory_imported", ids=[category.id for category in brought.categories])
        return brought

    def undo(self, entry_id: str, *, actor: str | None = None) -> AuditEntry:
        """Takes back a change of the audit trail. Raises NotFound, and Conflict where it cannot be undone (any more)."""
        undone = self._memory.undo(entry_id, actor=actor)
        self._events.publish("change_undone", id=entry_id, category_id=undone.category_id)
        return undone
