"""How numbers, times and changes are worded on a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from store.records import Action, AuditEntry

SHORT = 8
"""Characters of an id that people compare."""
FEW = 4
"""Enough to tell the categories of a page apart."""


def milliseconds(value: float) -> str:
    """840 ms, 5.9 s."""
    return f"{value:.0f} ms" if value < 1000 else f"{value / 1000:.1f} s"


def metres(value: float) -> str:
    """4.2 cm, 1.30 m."""
    return f"{100 * value:.1f} cm" if value < 1 else f"{value:.2f} m"


def percent(share: float) -> str:
    """87 %; nearly all and nearly nothing are not rounded to certainty."""
    if 0 < share < 0.005:
        return "< 1 %"
    return "> 99 %" if 0.995 <= share < 1 else f"{100 * share:.0f} %"


def short_id(identifier: str) -> str:
    """Its first characters."""
    return identifier[:SHORT]


def clock(iso: str) -> str:
    """2026-01-31 12:00:00 UTC of an ISO 8601 time; the browser words it in its own zone."""
    return f"{iso[:10]} {iso[11:19]} UTC"


def called(name: str | None, identifier: str | None) -> str:
    """A category's name, else the beginning of its id; it may be gone."""
    if identifier is None:
        return "a category that is gone"
    return name or f"unnamed {identifier[:FEW]}"


def decimal(value: float | None, digits: int = 2) -> str:
    """With so many digits; a dash where there is none."""
    return "–" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"  # never -0.00


def quantity(count: int, what: str, plural: str | None = None) -> str:
    """1 burst, 3 bursts."""
    return f"{count} {what if count == 1 else plural or what + 's'}"


def megabytes(size: int) -> str:
    """12.3 MB, 1.20 GB."""
    return f"{size / 1e6:.1f} MB" if size < 1e9 else f"{size / 1e9:.2f} GB"


def change_words(entry: AuditEntry, names: Mapping[str, str | None]) -> str:
    """What a change was, in a sentence."""
    before, after = entry.before, entry.after

    def name(category_id: str | None) -> str:
        if category_id is None or category_id not in names:
            return "a category that is gone"
        return f"“{called(names[category_id], category_id)}”"

    def quoted(said: str | None) -> str:
        return f"“{called(said, entry.category_id)}”"

    this = name(entry.category_id)
    learnt = quoted(after["name"]) if after.get("name") else this
    words: dict[Action, Callable[[], str]] = {
        "create": lambda: f"Learnt {learnt} from {quantity(after['views'], 'view')}",
        "rename": lambda: f"Renamed {quoted(before['name'])} to {quoted(after['name'])}",
        "merge": lambda: f"Merged {quoted(before['name'])} into {name(after['into'])}, {quantity(len(before['instances']), 'burst')}",
        "split": lambda: f"Split {quantity(len(before['instances']), 'burst')} off {this} as {name(after['category'])}",
        "delete": lambda: f"Deleted {quoted(before['name'])} with {quantity(before['instances'], 'burst')}",
        "forget": lambda: f"Took a burst out of {this}",
        "import": lambda: f"Imported {quantity(len(after['categories']), 'category', 'categories')}" + _twins(len(after["duplicates"])),
        "correct": lambda: "Corrected an observation",
        "reembed": lambda: "Computed the memory anew",
        "undo": lambda: f"Took back: {before['action']}" + (f" of {this}" if entry.category_id in names else ""),
        "calibrate": lambda: _rate_words(after["false_known_rate"]),
        "backup": lambda: f"Backed up the memory to {after['folder']}",
        "export": lambda: f"Exported {quantity(after['categories'], 'category', 'categories')}",
        "key": lambda: f"Made a key for {after['name']}, {after['role']}",
        "revoke": lambda: f"Revoked the key of {before['name']}",
    }
    return words[entry.action]()


def _twins(count: int) -> str:
    return f"; {count} {'was' if count == 1 else 'were'} there already" if count else ""


def _rate_words(rate: float | None) -> str:
    return "Set the false-known rate to the setting's" if rate is None else f"Set the false-known rate to {100 * rate:g} %"


FILTERS: dict[str, Callable[..., Any]] = {
    "milliseconds": milliseconds,
    "metres": metres,
    "percent": percent,
    "short_id": short_id,
    "clock": clock,
    "called": called,
    "decimal": decimal,
    "quantity": quantity,
    "megabytes": megabytes,
    "change": change_words,
}
"""By their names in templates."""
