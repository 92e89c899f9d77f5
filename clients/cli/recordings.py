"""`onelook samples` and `onelook convert`: folders of recordings from other ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from clients.cli.terminal import SOURCE, Json, console, errors, print_json, progress_bar


def samples(
    data: Annotated[Path, typer.Option(help="Folder of recorded objects to draw from.")],
    out: Annotated[Path, typer.Option(help="New folder for the small copies.")],
    categories: Annotated[int, typer.Option(min=1, help="Categories to draw.")] = 5,
    instances: Annotated[int, typer.Option(min=1, help="Objects of each category.")] = 3,
    views: Annotated[int, typer.Option(min=2, help="Views of each object.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Of the draw.")] = 0,
    json: Json = False,
) -> None:
    """Make small copies of recorded objects, in the same layout, drawn by a seed."""
    from clients.datasets.shrink import ShrinkConfig, shrink

    with errors.status("making small copies"):
        names = shrink(data, out, ShrinkConfig(categories=categories, instances=instances, views=views), seed=seed)
    if json:
        print_json([str(out / name) for name in names])
    else:
        console.print(f"{len(names)} objects in {out}: {', '.join(names)}")


def convert(
    source: Annotated[str, typer.Argument(help=f"What to read: {SOURCE}.")],
    out: Annotated[Path, typer.Argument(help="New folder for the recordings in the data layout.")],
    json: Json = False,
) -> None:
    """Write recordings of another format in the data layout."""
    from clients.datasets.convert import convert as write
    from clients.datasets.sources import find_sequences

    with errors.status(Text(f"reading {source}")):
        sequences = find_sequences(source)
    written = list(progress_bar(write(sequences, out), "converting", len(sequences)))
    if json:
        print_json([str(folder) for folder in written])
    else:
        console.print(f"{len(written)} objects in {out}")
