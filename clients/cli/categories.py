"""`onelook categories`: what the service has learnt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Protocol, TypeVar

import typer

from clients.answers.categories import Category
from clients.cli.terminal import URL, Json, Url, console, print_json, print_table, require_behind, when
from clients.errors import ClientError
from clients.robot import RobotClient

app = typer.Typer(help="List, rename or forget the categories of the memory.")

Which = Annotated[str, typer.Argument(help="The category's name, its id, or the id's first characters.")]


@app.callback(invoke_without_command=True)
def categories(context: typer.Context, url: Url = URL, json: Json = False) -> None:
    """List the categories of the memory, or rename or forget one."""
    if context.invoked_subcommand is None:
        list_categories(url, json)
    else:
        require_behind(context)


@app.command("list")
def list_categories(url: Url = URL, json: Json = False) -> None:
    """List the categories, oldest first."""
    with RobotClient(url) as robot:
        categories = robot.categories()
    if json:
        print_json([asdict(category) for category in categories])
    else:
        print_table([_row(category) for category in categories], "The memory is empty; `onelook scan FOLDER` teaches it a category.")


@app.command()
def rename(category: Which, name: Annotated[str, typer.Argument(help="What people call it.")], url: Url = URL, json: Json = False) -> None:
    """Give a category a name."""
    with RobotClient(url) as robot:
        renamed = robot.rename(find(robot.categories(), category).id, name)
    if json:
        print_json(asdict(renamed))
    else:
        console.print(f"{renamed.id} is called {renamed.name}")


@app.command()
def forget(category: Which, url: Url = URL, json: Json = False) -> None:
    """Delete a category and all that was learnt with it."""
    with RobotClient(url) as robot:
        forgotten = find(robot.categories(), category)
        robot.forget(forgotten.id)
    if json:
        print_json(asdict(forgotten))
    else:
        console.print(f"forgot {forgotten.name or forgotten.id}")


class Named(Protocol):
    """A category as the service tells of it, or as the memory keeps it."""

    @property
    def id(self) -> str:
        """Hexadecimal."""

    @property
    def name(self) -> str | None:
        """What people call it."""


NamedT = TypeVar("NamedT", bound=Named)


def find(categories: Sequence[NamedT], which: str) -> NamedT:
    """The category that `which` names or whose id starts with it. Raises ClientError unless it is exactly one."""
    found = [each for each in categories if each.name == which] or [each for each in categories if each.id.startswith(which)]
    if len(found) != 1:
        called = f"{len(found)} categories are called {which!r} or have" if found else f"no category is called {which!r} or has"
        raise ClientError(f"{called} an id that starts so; `onelook categories list`, or `onelook memory list` of a folder, shows them")
    return found[0]


def _row(category: Category) -> dict[str, str]:
    return {
        "id": category.id[:8],
        "name": category.name or "–",
        "views": str(category.views),
        "instances": str(category.instances),
        "size": " × ".join(f"{100 * edge:.0f}" for edge in category.extent_m) + " cm",
        "learnt": when(category.created_at),
    }
