"""`onelook simulate`: episodes and the demo, driven by a simulated robot."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from clients.cli.terminal import Json, console, errors, print_json


class WorldKind(str, Enum):
    """Where the simulated robot looks."""

    raycast = "raycast"
    replay = "replay"


Out = Annotated[Path, typer.Option(help="Folder for the report, the JSON and the memory of the run.")]
ServiceUrl = Annotated[str | None, typer.Option(help="A service with an empty memory; one is started and stopped where left out.")]


def simulate(
    script: Annotated[Path | None, typer.Argument(help="YAML file that says what happens; the demo where left out.")] = None,
    out: Out = Path("out/demo"),
    world: Annotated[WorldKind | None, typer.Option(help="Rendered, or recorded views; raycast where left out.")] = None,
    data: Annotated[str | None, typer.Option(help="Recordings for replay; the samples of the repository where left out.")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of worlds, objects, their order and their views; 0 where left out.")] = None,
    views: Annotated[int | None, typer.Option(min=2, help="Views in the burst of each encounter; 8 where left out.")] = None,
    robots: Annotated[int | None, typer.Option(min=1, help="Robots that share the memory, each in a world of its own.")] = None,
    resume: Annotated[bool, typer.Option(help="Continue the interrupted run in --out.")] = False,
    url: ServiceUrl = None,
    json: Json = False,
) -> None:
    """Drive a service with a simulated robot: meet objects, learn the novel, recognise the known, report.

    Exits with 1 where the memory is not what the robots made of it.

    \f
    Options that are given win over what the script says.
    """
    from clients.simulator.runner import Output, run_episode, run_lessons
    from clients.simulator.script import Script, check, read_script

    given: dict[str, Any] = {"world": world.value if world else None, "data": data, "seed": seed, "views": views, "robots": robots}
    base = read_script(script) if script else Script()
    if data is not None and world is None:
        given["world"] = WorldKind.replay.value
    plan = check(replace(base, **{name: value for name, value in given.items() if value is not None}))
    # Says what there is none of before the memory of a former run is deleted.
    subjects = [plan.subjects(robot) for robot in range(plan.robots)]
    output = Output(out)
    out.mkdir(parents=True, exist_ok=True)
    if resume:
        output.earlier_lessons(plan) if plan.teacher else output.earlier(plan)
    screen = errors if json else console
    with service(url, out, fresh=not resume) as address:
        summary: Any = (
            run_lessons(plan, subjects[0], address, output, screen, resume=resume)
            if plan.teacher
            else run_episode(plan, subjects, address, output, screen, resume=resume)
        )
    if json:
        print_json(asdict(summary))
    if not plan.teacher and summary.disagreements:
        raise typer.Exit(1)


@contextmanager
def service(url: str | None, out: Path, *, fresh: bool = True) -> Iterator[str]:
    """The address of the service named, or of one started for the time being, whose memory stays in `out`."""
    if url is not None:
        yield url
        return
    from clients.simulator.local_service import local_service
    from core.backbones.weights import embedded_weights

    with errors.status("looking for the backbone's weights"):
        embedded_weights(report=errors.print)
    memory = out / "memory"
    if fresh and memory.exists():
        shutil.rmtree(memory)
    with errors.status("starting the service") as status, local_service(memory, out / "service.log") as address:
        status.stop()
        yield address
