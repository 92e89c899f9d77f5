"""What the commands share: where they print, and the options that several have."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated, TypeVar

import typer
from rich.console import Console
from rich.progress import Progress, track
from rich.table import Table
from rich.text import Text

from clients.robot import DEFAULT_URL
from core.errors import InvalidInput

T = TypeVar("T")
LOG_WIDTH = 120
"""Characters a line where the output is no terminal: nothing says how wide a file is."""
console = Console(width=None if sys.stdout.isatty() else LOG_WIDTH, markup=False, emoji=False)
errors = Console(stderr=True, markup=False, emoji=False)
"""Both print text as it is: names and paths may have brackets and colons."""

Url = Annotated[str, typer.Option(help="Address of the service.", envvar="ONELOOK_URL")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
SOURCE = "a folder in the data layout, or FORMAT:FOLDER with a format of docs/data.md"
Folder = Annotated[str, typer.Argument(help=f"A recorded object: {SOURCE}.")]
URL = DEFAULT_URL


def require_behind(context: typer.Context) -> None:
    """Raises InvalidInput for an option before the subcommand, which has its own: `--url` there would name a service that is not asked."""
    for name in context.params:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            raise InvalidInput(f"--{name}", f"goes behind {context.invoked_subcommand}, not before it")


def progress_bar(items: Iterable[T], doing: str, total: int) -> Iterator[T]:
    """The items, with a bar on a terminal's standard error: standard output stays what other programs read."""
    yield from track(items, doing, total, console=errors, transient=True, disable=not errors.is_terminal)


@contextmanager
def progress_of(doing: str) -> Iterator[Callable[[int, int], None]]:
    """A bar as in `progress_bar`, for work that tells itself how much of how much is done."""
    bar = Progress(*Progress.get_default_columns(), console=errors, transient=True, disable=not errors.is_terminal)
    with bar:
        task = bar.add_task(doing, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def when(time: str) -> str:
    """An ISO time, as of the service's JSON, to the second and without its zone, which is UTC."""
    return time[:19].replace("T", " ")


def print_json(value: object) -> None:
    """JSON on standard output, unwrapped and uncoloured."""
    typer.echo(json.dumps(value, indent=1))


def print_table(rows: Sequence[Mapping[str, str | Text]], empty: str) -> None:
    """One column a key; `empty` where there are no rows."""
    if not rows:
        console.print(empty)
        return
    table = Table(*rows[0], header_style="dim", pad_edge=False, box=None)
    for row in rows:
        table.add_row(*row.values())
    console.print(table)


def print_facts(facts: Mapping[str, object], title: str | None = None) -> None:
    """One line a fact."""
    table = Table(show_header=False, box=None, pad_edge=False, title=title, title_justify="left")
    table.add_column(style="dim")
    table.add_column(overflow="fold")
    for name, value in facts.items():
        table.add_row(name, str(value))
    console.print(table)
