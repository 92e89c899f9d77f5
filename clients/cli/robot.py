"""`onelook observe` and `onelook scan`: what a robot asks, with a recorded folder in the place of its camera."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from clients.cli.categories import find
from clients.cli.terminal import URL, Folder, Json, Url, console, print_facts, print_json
from clients.errors import ClientError
from clients.robot import Observation, RobotClient

if TYPE_CHECKING:
    from clients.simulator.replay import ReplayWorld

GLANCE_VIEWS = 3
"""Views that a scan starts from: they say where the object is."""

Views = Annotated[int | None, typer.Option(min=1, help="Use this many views, spread around the object; all where left out.")]


def observe(
    folder: Folder,
    url: Url = URL,
    views: Views = None,
    category: Annotated[str | None, typer.Option(help="Take the object for one of this category (name or id).")] = None,
    threshold: Annotated[float | None, typer.Option(help="Least similarity of a known object.")] = None,
    learn: Annotated[bool, typer.Option(help="Whether a known object's views join its category.")] = True,
    json: Json = False,
) -> None:
    """Ask what a recorded object is, and where and how turned."""
    burst = _world(folder).glance(views)
    with RobotClient(url) as robot:
        options: dict[str, Any] = {"learn": learn}
        if category is not None:
            options["category_id"] = find(robot.categories(), category).id
        if threshold is not None:
            options["threshold"] = threshold
        seen = robot.observe(burst, **options)
    if json:
        print_json(seen.raw)
    else:
        print_facts(_facts(seen))


def scan(
    folder: Folder,
    url: Url = URL,
    name: Annotated[str | None, typer.Option(help="What people call the category.")] = None,
    views: Views = None,
    json: Json = False,
) -> None:
    """Teach the memory a category from one recorded object."""
    world = _world(folder)
    with RobotClient(url) as robot:
        request = robot.scan(world.glance(GLANCE_VIEWS))
        for view in world.glance(views).views:
            request.add(view)
        category = request.complete(name)
    if json:
        print_json(asdict(category))
    else:
        console.print(f"learnt {category.name or 'a category without a name'} ({category.id}) from {category.views} views")


def _world(folder: Path) -> ReplayWorld:
    from clients.datasets.sources import find_sequences
    from clients.simulator.replay import ReplayWorld

    sequences = find_sequences(folder)
    if len(sequences) > 1:
        raise ClientError(f"{folder} holds {len(sequences)} objects; name one, such as {sequences[0].path}")
    return ReplayWorld(sequences[0])


def _facts(seen: Observation) -> dict[str, object]:
    facts: dict[str, object] = {"outcome": seen.outcome}
    if seen.category_id is not None:
        facts["category"] = f"{seen.name} ({seen.category_id})" if seen.name else seen.category_id
    if seen.similarities:
        limit = "" if seen.threshold is None else f", threshold {seen.threshold:.3f}"
        facts["similarity"] = f"{seen.similarities[0].similarity:.3f}{limit}"
    if seen.probability is not None:
        facts["probability"] = f"{seen.probability:.2f} that it is of the most similar category"
    if seen.pose is not None:
        facts["scale"] = f"{seen.pose.scale:.3f} of the reference"
        facts["centre"] = ", ".join(f"{value:.3f}" for value in seen.pose.object_in_world[:3, 3]) + " m in the burst's world frame"
        facts["box"] = " × ".join(f"{100 * edge:.1f}" for edge in seen.pose.extent_m) + " cm"
        facts["inliers"] = f"{seen.pose.inliers} of {seen.pose.correspondences} correspondences"
    if seen.scan is not None:
        facts["scan"] = f"{len(seen.scan)} viewpoints asked for ({seen.scan.id}); `onelook scan FOLDER` learns the category"
    facts |= {"no pose": seen.pose_error} if seen.pose_error else {}
    facts |= {"no scan": seen.scan_error} if seen.scan_error else {}
    return facts | {"observation": seen.id, "time": f"{seen.timings_ms['total']:.0f} ms"}
