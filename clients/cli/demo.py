"""`onelook simulate`, the demo."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from clients.cli.terminal import console


class WorldKind(str, Enum):
    """Where the simulated robot looks."""

    replay = "replay"


def simulate(
    data: Annotated[Path | None, typer.Option(help="Folder of recorded objects; the samples of the repository where left out.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for report.html and episode.json.")] = Path("out/demo"),
    seed: Annotated[int, typer.Option(help="Of the order of the objects and of the views of each.")] = 0,
    views: Annotated[int, typer.Option(min=2, help="Views in the burst of each encounter.")] = 8,
    world: Annotated[WorldKind, typer.Option(help="What the robot looks at: recorded views.")] = WorldKind.replay,
    url: Annotated[str | None, typer.Option(help="A service with an empty memory; one is started and stopped where left out.")] = None,
) -> None:
    """Drive a service with a simulated robot: meet objects, learn the novel, recognise the known, report.

    \f
    `world` has one kind so far; it is named so that scripts keep working when there are more.
    """
    from clients.datasets.samples import data_or_samples
    from clients.datasets.sources import find_sequences
    from clients.robot import RobotClient
    from clients.simulator.episode import Episode, summarise
    from clients.simulator.live import show, summary_table
    from clients.simulator.pictures import fetch_pictures
    from clients.simulator.report import EpisodeRecord, write_json, write_report

    data = data_or_samples(data)
    sequences = find_sequences(data)
    out.mkdir(parents=True, exist_ok=True)
    with _service(url, out / "service.log") as address, RobotClient(address) as robot:
        started = time.perf_counter()
        episode = Episode(robot, sequences, views, seed)
        encounters = show(episode, len(episode.sequences), console)
        summary = summarise(encounters, time.perf_counter() - started)
        with console.status("drawing the report"):
            pictures = [fetch_pictures(robot, encounter) for encounter in encounters]
        settings = {"world": world.value, "data": data.name, "seed": seed, "views": views}
        record = EpisodeRecord(summary, encounters, pictures, robot.categories(), robot.info(), settings)
    write_report(record, out / "report.html")
    write_json(record, out / "episode.json")
    console.print(summary_table(summary))
    console.print(f"\nreport: {out / 'report.html'}")


@contextmanager
def _service(url: str | None, log: Path) -> Iterator[str]:
    """The address of the service named, or of one started for the time being."""
    if url is not None:
        yield url
        return
    from clients.simulator.local_service import local_service
    from core.backbones.weights import embedded_weights

    with console.status("looking for the backbone's weights"):
        embedded_weights(report=console.print)
    with tempfile.TemporaryDirectory(prefix="onelook-") as memory:
        status = console.status("starting the service")
        status.start()
        with local_service(Path(memory), log) as address:
            status.stop()
            yield address
