"""`onelook rearrange`: the paper's rearrangement experiment in the simulated world."""

from __future__ import annotations

import json as jsonlib
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from clients.cli.simulate import Out, ServiceUrl, service
from clients.cli.terminal import Json, console, errors, print_facts, print_json

if TYPE_CHECKING:
    from clients.simulator.rearrange import RearrangeSummary

CATEGORIES = ["mug", "teapot", "car", "camera", "chair", "duck", "house", "locomotive", "clock", "laptop"]
"""Without those that are alike from several sides."""


def rearrange(
    out: Out = Path("out/rearrange"),
    trials: Annotated[int, typer.Option(min=1, help="Objects to be brought to the goal of their category.")] = 50,
    category: Annotated[list[str] | None, typer.Option(help="Category of the simulator; may be repeated; ten where left out.")] = None,
    views: Annotated[int, typer.Option(min=2, help="Views in each burst.")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="Of objects, poses, rooms and faults.")] = 0,
    resume: Annotated[bool, typer.Option(help="Continue the interrupted batch in --out.")] = False,
    url: ServiceUrl = None,
    json: Json = False,
) -> None:
    """Show a reference at a goal, bring other objects of its category there, and measure how they end."""
    from clients.robot import RobotClient
    from clients.simulator.journal import interrupted, kept
    from clients.simulator.raycast.export import draw_models
    from clients.simulator.rearrange import Rearrangement, Trial, drawn_before, summarise, write_json, write_picture

    categories = category or CATEGORIES
    draw_models(categories, 1, seed)  # says at once which category there is none of
    out.mkdir(parents=True, exist_ok=True)
    screen = errors if json else console
    settings: dict[str, object] = {"categories": categories, "trials": trials, "views": views, "seed": seed}
    lines, picture = out / "rearrange.jsonl", out / "rearrange.png"
    done = [Trial(**jsonlib.loads(line)) for line in interrupted(lines, settings)] if resume else []
    if not resume:
        picture.unlink(missing_ok=True)  # of another batch
    earlier = drawn_before(picture)
    with service(url, out, fresh=not resume) as address, RobotClient(address) as robot:
        batch = Rearrangement(robot, categories, trials, views, seed, done=len(done))
        with screen.status(f"{len(done) + 1} of {trials}") as status:
            for trial in kept(batch, lines, settings, lambda trial: jsonlib.dumps(asdict(trial)), tuple(done)):
                done.append(trial)
                how = trial.failure or f"{trial.rotation_deg:.1f}° and {100 * (trial.position_m or 0):.1f} cm off"
                screen.print(f"{trial.number:>3}  {trial.name or trial.category:<24} {how}", highlight=False)
                status.update(f"{len(done) + 1} of {trials}")
                if batch.pictured(trial):
                    write_picture([*earlier, *batch.pictures], picture)
    summary = summarise(done)
    write_json(done, summary, settings, out / "rearrange.json")
    if json:
        print_json(asdict(summary))
        return
    print_facts(_facts(summary) | {"written": f"{out / 'rearrange.json'}, {picture}"})


def _facts(summary: RearrangeSummary) -> dict[str, str]:
    return {
        "brought to the goal": f"{summary.moved} of {summary.trials}; {summary.recognised} recognised",
        "within 30° and 5 cm": f"{summary.success:.0f} % of all",
        "Acc30, Acc15, Acc7.5": f"{summary.acc30:.0f} %, {summary.acc15:.0f} %, {summary.acc7_5:.0f} % of all",
        "rotation": f"{_or_none(summary.median_deg, 1)}° median, {_or_none(summary.start_median_deg, 1)}° before",
        "position of the base": f"{_or_none(summary.median_m, 100)} cm median, {_or_none(summary.start_median_m, 100)} cm before",
        "time": f"{summary.total_s:.0f} s",
    }


def _or_none(value: float | None, factor: float) -> str:
    return "none" if value is None else f"{factor * value:.1f}"
