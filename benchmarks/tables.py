"""Benchmark results: a table for people, `{"meta": {...}, "rows": [{...}]}` for programs."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Row = Mapping[str, object]
Meta = Mapping[str, object]
FILE_WIDTH = 140
"""Columns of text where the output is no terminal."""


def machine() -> dict[str, object]:
    """What a figure depends on besides the data: versions and processor."""
    return {
        "onelook": version("onelook"),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "torch": version("torch"),
        "processor": _processor(),
        "cores": os.cpu_count(),
    }


def report(title: str, rows: Sequence[DataclassInstance], meta: Meta, json: Path | None, columns: Sequence[str] | None = None) -> None:
    """The end of a benchmark: its rows as a table, and in the file `json` where one is named; every column where `columns` is left out."""
    told = [asdict(row) for row in rows]
    if json is not None:
        write_json(json, meta, told)
    print_table(title, told, columns or (list(told[0]) if told else ()))


def print_table(title: str, rows: Sequence[Row], columns: Sequence[str]) -> None:
    """Prints `columns` of `rows`; a value that does not exist (None, or not finite) prints as a dash."""
    console = Console(markup=False, emoji=False)  # names may have brackets
    if not console.is_terminal:
        console.width = FILE_WIDTH
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for column in columns:
        cells = [_cell(row.get(column)) for row in rows]
        numeric = any(isinstance(row.get(column), (int, float)) for row in rows)
        table.add_column(column.replace("_", " "), justify="right" if numeric else "left", min_width=max(map(len, cells), default=0))
    for row in rows:
        table.add_row(*(_cell(row.get(column)) for column in columns), end_section=row.get("category") == "all")
    console.print(table)


def write_json(path: Path, meta: Meta, rows: Sequence[Row]) -> None:
    """Writes `{"meta", "rows"}`, the machine in `meta` too; values that are not finite become null, since JSON has no infinity."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"meta": _plain({**meta, **machine()}), "rows": _plain(rows)}, indent=1, allow_nan=False) + "\n")


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return round(value, 6) if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def _cell(value: object) -> str:
    value = _plain(value)
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.1f}" if abs(value) >= 10 else f"{value:.3f}".rstrip("0").rstrip(".")
    return str(value)


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        if names:
            return names[0]
    return platform.processor() or platform.machine()
