"""The service itself, and its memory as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from clients.answers.categories import Category


@dataclass(frozen=True)
class Info:
    """What the service says of itself and its memory."""

    version: str
    backbone: str
    fingerprint: str
    score: str
    threshold: float | None
    """None where the score, or the rate, decides."""
    false_known_rate: float
    variant: str
    categories: int
    memory_version: int

    @staticmethod
    def from_json(answer: Mapping[str, Any]) -> Info:
        """From the service's answer."""
        return Info(**{each.name: answer[each.name] for each in fields(Info)})


@dataclass(frozen=True)
class MemoryInfo:
    """What a memory holds, what it was made with, and how it decides."""

    version: int
    """Grows with each change."""
    backbone: str | None
    fingerprint: str | None
    score: str
    threshold: float | None
    """None where the score or the rate decides."""
    false_known_rate: float
    categories: int
    instances: int
    observations: int
    scans: int
    goals: int
    size_bytes: int

    @staticmethod
    def from_json(answer: Mapping[str, Any]) -> MemoryInfo:
        """From the service's answer."""
        return MemoryInfo(**{each.name: answer[each.name] for each in fields(MemoryInfo)})


@dataclass(frozen=True)
class Thresholds:
    """What the decision asks for at present."""

    false_known_rate: float
    tokens: float
    """Least similarity of a known object, of bursts without depth or cameras."""
    verified: float
    """The same of bursts whose poses could be tried."""
    decisions: int

    @staticmethod
    def from_json(answer: Mapping[str, Any]) -> Thresholds:
        """From the service's answer."""
        return Thresholds(**{each.name: answer[each.name] for each in fields(Thresholds)})


@dataclass(frozen=True)
class Backup:
    """A copy that opens as a memory."""

    folder: str
    """On the service's machine."""
    files: int
    size_bytes: int
    damages: tuple[str, ...]
    """What is damaged in the memory, and so in its copy."""

    @staticmethod
    def from_json(answer: Mapping[str, Any]) -> Backup:
        """From the service's answer."""
        return Backup(answer["folder"], answer["files"], answer["size_bytes"], tuple(answer["damages"]))


@dataclass(frozen=True)
class Import:
    """What an archive brought."""

    entry_id: str
    """Of the audit trail."""
    categories: tuple[Category, ...]
    """New ones, under ids of this memory."""
    duplicates: tuple[Category, ...]
    """Those that the memory had already."""
    same_name: tuple[str, ...]
    """Names of new ones that other categories have, too."""

    @staticmethod
    def from_json(answer: Mapping[str, Any]) -> Import:
        """From the service's answer."""
        new, known = (tuple(Category.from_json(each) for each in answer[name]) for name in ("categories", "duplicates"))
        return Import(answer["entry_id"], new, known, tuple(answer["same_name"]))
