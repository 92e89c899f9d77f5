"""`onelook observe` and `onelook scan`: what a robot asks, with a recorded folder in the place of its camera."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clients.bop_results import HEADER, bop_lines, number_of
from clients.cli.categories import find
from clients.cli.local import connected
from clients.cli.terminal import URL, Folder, Json, Url, console, errors, print_facts, print_json, progress_bar
from clients.robot import Observation, RobotClient

if TYPE_CHECKING:
    from clients.datasets.folders import Sequence
    from core.views import Burst

GLANCE_VIEWS = 3
"""Views that a scan starts from: they say where the object is."""

Views = Annotated[int | None, typer.Option(min=1, help="Use this many views, spread around the object; all where left out.")]
Local = Annotated[bool, typer.Option("--local", help="Ask no running service: open the memory here (ONELOOK_DATA_DIR).")]


class Format(str, Enum):
    """Other shapes of an answer."""

    bop = "bop"
    vision_msgs = "vision_msgs"


def observe(
    folder: Folder,
    url: Url = URL,
    local: Local = False,
    views: Views = None,
    category: Annotated[str | None, typer.Option(help="Take the object for one of this category (name or id).")] = None,
    threshold: Annotated[float | None, typer.Option(help="Least similarity of a known object.")] = None,
    learn: Annotated[bool, typer.Option(help="Whether a known object's views join its category.")] = True,
    form: Annotated[
        Format | None, typer.Option("--format", help="bop: lines of the BOP benchmark's results; vision_msgs: JSON of the ROS message.")
    ] = None,
    json: Json = False,
) -> None:
    """Ask what a recorded object is, and where and how turned."""
    sequence, recorded = _recording(folder)
    chosen = _spread(recorded, views)
    burst = recorded.select(chosen)
    with connected(url, local) as robot:
        options: dict[str, Any] = {"learn": learn}
        if category is not None:
            options["category_id"] = find(robot.categories(), category).id
        if threshold is not None:
            options["threshold"] = threshold
        with errors.status(f"asking about {len(burst)} views"):
            seen = robot.observe(burst, **options)
        if form is Format.vision_msgs:
            print_json(robot.detections(seen.id))
        elif form is Format.bop:
            _print_bop(seen, robot, burst, [sequence.images[index] for index in chosen], sequence.path)
        elif json:
            print_json(seen.raw)
        else:
            print_facts(_facts(seen))


def scan(
    folder: Folder,
    url: Url = URL,
    local: Local = False,
    name: Annotated[str | None, typer.Option(help="What people call the category.")] = None,
    views: Views = None,
    json: Json = False,
) -> None:
    """Teach the memory a category from one recorded object; what is wrong with a view is said on standard error."""
    _, recorded = _recording(folder)
    with connected(url, local) as robot:
        with errors.status("looking for the object"):
            request = robot.scan(recorded.select(_spread(recorded, GLANCE_VIEWS)))
        places = _spread(recorded, views)
        for place in progress_bar(places, "sending views", len(places)):
            for fault in request.add(recorded.views[place]):
                errors.print(f"view {place}: {fault}")
        with errors.status("learning"):
            category = request.complete(name)
    if json:
        print_json(asdict(category))
    else:
        console.print(f"learnt {category.name or 'a category without a name'} ({category.id}) from {category.views} views")


def _recording(folder: str) -> tuple[Sequence, Burst]:
    """The one object that `folder` holds, and all its views."""
    from clients.datasets.folders import load_burst
    from clients.datasets.sources import only_sequence

    sequence = only_sequence(folder)
    return sequence, load_burst(sequence)


def _spread(burst: Burst, count: int | None) -> list[int]:
    """Places of `count` views, seen from directions far apart where cameras tell; all where None."""
    from clients.datasets.viewpoints import spread

    if count is None or any(view.camera is None for view in burst.views):
        return list(range(len(burst)))[:count]
    return spread(burst.cameras, count)


def _print_bop(seen: Observation, robot: RobotClient, burst: Burst, images: list[Path], folder: Path) -> None:
    """The header alone where the object has no pose."""
    typer.echo(HEADER)
    if seen.pose is None:
        return
    ids = [each.id for each in robot.categories()]
    number = number_of(seen.name, ids.index(seen.category_id) + 1 if seen.category_id in ids else 0)
    seconds = seen.timings_ms["total"] / 1000
    for line in bop_lines(seen.pose, burst.cameras, images, number_of(folder.name, 0), number, seconds):
        typer.echo(line)


def _facts(seen: Observation) -> dict[str, object]:
    facts: dict[str, object] = {"outcome": seen.outcome}
    if seen.category_id is not None:
        facts["category"] = f"{seen.name} ({seen.category_id})" if seen.name else seen.category_id
    if seen.similarities:
        limit = "" if seen.threshold is None else f", threshold {seen.threshold:.3f}"
        facts["similarity"] = f"{seen.similarities[0].similarity:.3f}{limit}"
    if seen.probability is not None:
        facts["probability"] = f"{seen.probability:.2f} that it is of the most similar category"
    if seen.candidates:
        names = {each.category_id: each.name for each in seen.similarities}
        facts["candidates"] = ", ".join(names.get(each) or each for each in seen.candidates)
    if seen.viewpoints is not None and len(seen.viewpoints):
        facts["look from"] = ", ".join(f"{value:.2f}" for value in seen.viewpoints[0][:3, 3]) + " m, in the burst's world frame, next"
    if seen.pose is not None:
        facts["scale"] = f"{seen.pose.scale:.3f} of the reference"
        facts["centre"] = ", ".join(f"{value:.3f}" for value in seen.pose.world_from_object[:3, 3]) + " m in the burst's world frame"
        facts["box"] = " × ".join(f"{100 * edge:.1f}" for edge in seen.pose.extent_m) + " cm"
        if seen.pose.confidence is not None:
            facts["confidence"] = f"{seen.pose.confidence:.2f} that the rotation is within 30°"
        facts["inliers"] = f"{seen.pose.inliers} of {seen.pose.correspondences} correspondences"
    if seen.scan is not None:
        facts["scan"] = f"{len(seen.scan)} viewpoints asked for ({seen.scan.id}); `onelook scan FOLDER` learns the category"
    facts |= _grounds(seen.raw["grounds"] or {})
    facts |= {"no pose": seen.pose_error} if seen.pose_error else {}
    facts |= {"no scan": seen.scan_error} if seen.scan_error else {}
    return facts | {"observation": seen.id, "time": f"{seen.timings_ms['total']:.0f} ms"}


def _grounds(grounds: Mapping[str, Any]) -> dict[str, object]:
    """What is wrong with the views, each kind with the number of views that have it, and why the answer rests on little."""
    faults = Counter(fault["kind"] for view in grounds.get("faults", ()) for fault in view)
    facts: dict[str, object] = {}
    if faults:
        facts["faults"] = ", ".join(f"{kind} in {count}" for kind, count in faults.most_common()) + f" of {grounds['views']} views"
    return facts | ({"weakness": grounds["weakness"]} if grounds.get("weakness") else {})
