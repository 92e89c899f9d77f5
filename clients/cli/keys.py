"""`onelook keys`: who may ask the service for what. Works on the memory's folder, also while the service has it open."""

from __future__ import annotations

from dataclasses import asdict
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from clients.cli.memory import DataDir, folder_of
from clients.cli.terminal import Json, console, errors, print_json, print_table, when

if TYPE_CHECKING:
    from store.keys import Key

app = typer.Typer(help="Make, list and revoke the keys that the service asks for.", no_args_is_help=True)
ACTOR = "onelook keys"


class Role(str, Enum):
    """What a key allows, each all that the ones before it do."""

    viewer = "viewer"
    robot = "robot"
    admin = "admin"


@app.command()
def create(
    name: Annotated[str, typer.Argument(help="Who will have it, such as arm-2; the audit trail tells it.")],
    role: Annotated[Role, typer.Option(help="viewer: read. robot: look, scan, follow, too. admin: change and copy the memory, too.")],
    data_dir: DataDir = None,
    json: Json = False,
) -> None:
    """Make a key and show it, this once: only its hash is kept."""
    from store.memory import Memory

    with Memory.keyring(folder_of(data_dir)) as keys:
        key, text = keys.create(name, role.value, actor=ACTOR)
    if json:
        print_json(asdict(key) | {"key": text})
        return
    typer.echo(text)
    errors.print(f"{key.role} key {key.id} for {key.name}: keep it now, it cannot be shown again", highlight=False)


@app.command("list")
def list_keys(data_dir: DataDir = None, json: Json = False) -> None:
    """List the keys that are valid, oldest first."""
    from store.memory import Memory

    with Memory.keyring(folder_of(data_dir)) as keys:
        found = keys.all()
    if json:
        print_json([asdict(key) for key in found])
    else:
        print_table([_row(key) for key in found], "There are no keys.")


@app.command()
def revoke(
    key_id: Annotated[str, typer.Argument(metavar="ID", help="As `onelook keys list` shows it.")],
    data_dir: DataDir = None,
    json: Json = False,
) -> None:
    """Let nobody in with a key from now on; sessions that began with it end."""
    from store.memory import Memory

    with Memory.keyring(folder_of(data_dir)) as keys:
        key = keys.revoke(key_id, actor=ACTOR)
    if json:
        print_json(asdict(key))
    else:
        console.print(f"revoked {key.id}, the {key.role} key of {key.name}", highlight=False)


def _row(key: Key) -> dict[str, str]:
    return {"id": key.id, "name": key.name, "role": key.role, "made": when(key.created_at)}
