"""`onelook memory`: what the service says of its memory, and the memory's folder itself, also while the service has it open."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from clients.cli.categories import find
from clients.cli.service import read_settings
from clients.cli.terminal import (
    URL,
    Json,
    Url,
    console,
    errors,
    print_facts,
    print_json,
    print_table,
    progress_of,
    require_behind,
    when,
)
from clients.robot import RobotClient

if TYPE_CHECKING:
    from store.check import Damage

app = typer.Typer(help="Inspect, check, back up, export, import or recompute a memory.")

DataDir = Annotated[Path | None, typer.Option(help="Folder of the memory; ONELOOK_DATA_DIR where left out.", show_default=False)]
Chosen = Annotated[list[str] | None, typer.Option("--category", help="Name, id or its first characters; repeat it for several.")]


@app.callback(invoke_without_command=True)
def memory(context: typer.Context, url: Url = URL, json: Json = False) -> None:
    """Show what the service says of itself and its memory, or work on a memory's folder."""
    if context.invoked_subcommand is not None:
        require_behind(context)
        return
    with RobotClient(url) as robot:
        facts = asdict(robot.info())
    if json:
        print_json(facts)
    else:
        print_facts(facts)


@app.command()
def info(data_dir: DataDir = None, json: Json = False) -> None:
    """Show how much is in the folder and what it was made with."""
    from store.memory import Memory

    with Memory.reading(folder_of(data_dir)) as stored:
        facts = {"folder": str(stored.folder), "backbone": stored.backbone, "fingerprint": stored.fingerprint}
        facts |= {"memory_version": stored.version} | asdict(stored.sizes())
    if json:
        print_json(facts)
    else:
        print_facts(facts | {"size": _megabytes(facts["size"])})


@app.command("list")
def list_categories(data_dir: DataDir = None, json: Json = False) -> None:
    """List the categories in the folder, oldest first."""
    from store.memory import Memory

    with Memory.reading(folder_of(data_dir)) as stored:
        categories = [asdict(category) for category in stored.categories.all()]
    if json:
        print_json(categories)
        return
    print_table([_row(each) for each in categories], "The memory is empty.")


@app.command()
def check(data_dir: DataDir = None, json: Json = False) -> None:
    """Read everything, name what is damaged and what still works; exits with 1 where anything is."""
    from store.memory import Memory

    with Memory.reading(folder_of(data_dir)) as stored, progress_of("checking") as progress:
        report = stored.check(progress)
    if json:
        print_json(asdict(report) | {"ok": report.ok})
    else:
        _print_damages(report.damages)
        console.print(f"{report.categories} categories, {report.files} files, {_megabytes(report.size)}: {_verdict(report.damages)}")
    if not report.ok:
        raise typer.Exit(1)


@app.command()
def backup(
    folder: Annotated[Path, typer.Argument(help="Folder to make; it opens as a memory.")], data_dir: DataDir = None, json: Json = False
) -> None:
    """Copy the whole memory to a new folder, and read the copy once."""
    from store.memory import Memory

    with Memory.reading(folder_of(data_dir)) as stored, progress_of("copying") as progress:
        done = stored.backup(folder, progress)
    if json:
        print_json(asdict(done) | {"folder": str(done.folder)})
    else:
        _print_damages(done.damages)
        console.print(f"{done.folder}: {done.files} files, {_megabytes(done.size)}: {_verdict(done.damages)}")


@app.command("export")
def export_categories(
    file: Annotated[Path, typer.Argument(help="File to make, such as cups.zip.")],
    category: Chosen = None,
    data_dir: DataDir = None,
    json: Json = False,
) -> None:
    """Write categories, all where none are named, to one file for another robot's memory."""
    from store.memory import Memory

    with Memory.reading(folder_of(data_dir)) as stored, progress_of("exporting") as progress:
        known = stored.categories.all()
        done = stored.export(file, [find(known, which).id for which in category] if category else None, progress)
    if json:
        print_json(asdict(done) | {"path": str(done.path)})
    else:
        without = f", without {done.left_out} damaged instances" if done.left_out else ""
        console.print(f"{done.path}: {done.categories} categories, {_megabytes(done.size)}{without}", soft_wrap=True)


@app.command("import")
def import_categories(
    file: Annotated[Path, typer.Argument(help="What `onelook memory export` wrote.")], data_dir: DataDir = None, json: Json = False
) -> None:
    """Take the categories of another memory; those that are there already stay as they are. The service must not run on the folder."""
    from store.memory import Memory

    with Memory.open(folder_of(data_dir)) as stored, progress_of("importing") as progress:
        done = stored.import_archive(file, actor="onelook memory import", progress=progress)
    if json:
        print_json(asdict(done))
        return
    for each in done.categories:
        also = f"; {len(each.same_name)} had this name already" if each.same_name else ""
        console.print(f"{each.name or '–'} is {each.id[:8]} here, with {each.instances} instances and {each.goals} goals{also}")
    for twin in done.duplicates:
        console.print(f"{twin.name or '–'} was here already as {twin.id[:8]}")


@app.command()
def reembed(
    backbone: Annotated[str | None, typer.Option(help="The new backbone; ONELOOK_BACKBONE where left out.", show_default=False)] = None,
    device: Annotated[str | None, typer.Option(help="Torch device; ONELOOK_DEVICE where left out.", show_default=False)] = None,
    data_dir: DataDir = None,
    json: Json = False,
) -> None:
    """Compute the memory anew from its views, with another backbone or again with the same. The service must not run on the folder."""
    from core.backbones import load_backbone
    from store.memory import Memory

    settings = read_settings({})
    with Memory.open(_folder_with_memory(data_dir)) as stored:
        loaded = load_backbone(backbone or settings.backbone, device=device or settings.device, report=errors.print)
        with progress_of("computing") as progress:
            done = stored.reembed(loaded, actor="onelook memory reembed", progress=progress)
    if json:
        print_json(asdict(done) | {"backbone": loaded.name, "fingerprint": loaded.fingerprint})
    else:
        print_facts({"backbone": loaded.name, "fingerprint": loaded.fingerprint} | asdict(done))


def _row(category: dict[str, Any]) -> dict[str, str]:
    shown = {"id": category["id"][:8], "name": category["name"] or "–"}
    counts = {name: str(category[name]) for name in ("views", "instances")}
    return shown | counts | {"learnt": when(category["created_at"])}


def folder_of(data_dir: Path | None) -> Path:
    """The one given, else that of the settings."""
    return data_dir or read_settings({}).data_dir


def _folder_with_memory(data_dir: Path | None) -> Path:
    """The same; raises NotFound where no memory is in it."""
    from store.memory import Memory

    folder = folder_of(data_dir)
    Memory.require(folder)
    return folder


def _print_damages(damages: tuple[Damage, ...]) -> None:
    for damage in damages:
        called = f"{damage.kind} {damage.name or damage.id or ''}".strip()
        said = f": {damage.file}: {damage.problem}. {damage.consequence}"
        console.print(Text.assemble((called, "bold red"), said), soft_wrap=True)


def _verdict(damages: tuple[Damage, ...]) -> str:
    return f"{len(damages)} damaged" if damages else "everything is what was written"


def _megabytes(size: object) -> str:
    assert isinstance(size, int)
    return f"{size / 1e6:.1f} MB"
