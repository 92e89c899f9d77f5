"""`onelook render`: objects of the rendered world as recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clients.cli.terminal import Json, console, print_json, progress_bar
from core.errors import InvalidInput

SHEET = "contact-sheet.jpg"


def render(
    out: Annotated[Path, typer.Option(help="New folder for the recordings.")],
    category: Annotated[list[str] | None, typer.Option(help="Category of the simulator; may be repeated; all where left out.")] = None,
    instances: Annotated[int, typer.Option(min=1, help="Objects of each category.")] = 4,
    views: Annotated[int, typer.Option(min=1, help="Views of each object.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Of objects, rooms, viewpoints and faults.")] = 0,
    meshes: Annotated[
        Path | None, typer.Option(help="Folder CATEGORY/INSTANCE.obj, .glb or .ply to render in place of the simulator's own objects.")
    ] = None,
    json: Json = False,
) -> None:
    """Render objects of the simulated world as recordings in the data layout, and a contact sheet of them."""
    from clients.simulator.raycast.export import contact_sheet, draw_models, export
    from clients.simulator.raycast.user_meshes import find_models

    if meshes and category:
        raise InvalidInput("--category", "is of the simulator's own objects; leave it or --meshes out")
    models = find_models(meshes) if meshes else draw_models(category or [], instances, seed)
    folders = list(progress_bar(export(models, views, out, seed), "rendering", len(models)))
    contact_sheet(folders, 8, out / SHEET)
    if json:
        print_json([str(folder) for folder in folders])
        return
    console.print(f"{len(folders)} objects in {out}, {views} views each; all of them at a glance: {out / SHEET}")
