"""`onelook bench`: every benchmark that has a command, each a table and JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clients.cli.terminal import SOURCE

app = typer.Typer(help="Measure how right, how fast and how robust it is: a table, and JSON.", no_args_is_help=True)

Data = Annotated[Path, typer.Option(help=f"Recorded objects: {SOURCE}.")]
JsonFile = Annotated[Path | None, typer.Option("--json", help='File for {"meta": …, "rows": …}.')]
Seed = Annotated[int, typer.Option(min=0, help="Of every random choice.")]
Backbone = Annotated[
    str, typer.Option(help="Name of a backbone, or a folder of the DINO family; an unknown name is answered with all there are.")
]
Categories = Annotated[list[str] | None, typer.Option(help="Category of the simulator; may be repeated; all where left out.")]
Samples = Annotated[Path | None, typer.Option(help="Folder of recorded objects; the samples of the repository where left out.")]
Url = Annotated[str | None, typer.Option(help="A service of this machine; one of its own where left out.")]
Plot = Annotated[Path | None, typer.Option(help="File for the curves, .png or .svg.")]
BACKBONE = "dinov2-s14"


@app.command()
def pose(
    data: Data,
    variant: Annotated[list[str], typer.Option(help="Variant of the pose pipeline; may be repeated.")] = ["ucd"],  # noqa: B006
    views: Annotated[list[str], typer.Option(help="Views of reference and target: 10, 10+3 or all; may be repeated.")] = ["10"],  # noqa: B006
    limit: Annotated[int | None, typer.Option(min=1, help="Pairs a category at most.")] = None,
    dims: Annotated[list[int] | None, typer.Option(help="Descriptor size; the variant's own where left out; may be repeated.")] = None,
    method: Annotated[
        list[str] | None, typer.Option(help="Correspondences: nearest, mutual, cyclical or cyclical-3d; may be repeated.")
    ] = None,
    consensus: Annotated[list[float] | None, typer.Option(help="Angle of the consensus, degrees; may be repeated.")] = None,
    inlier: Annotated[list[float] | None, typer.Option(help="Inlier threshold as a share of the extent; may be repeated.")] = None,
    estimator: Annotated[list[str] | None, typer.Option(help="Robust estimator (an unknown one lists all); may be repeated.")] = None,
    dof: Annotated[list[int] | None, typer.Option(help="7, or 9 with a scale for each axis; may be repeated.")] = None,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """Accuracy of the 7-D pose between objects of a category."""
    from benchmarks.contenders import Sweep
    from benchmarks.pose import run

    run(
        data=data,
        sweep=Sweep(variant, views, dims, method, consensus, inlier, estimator, dof),
        limit=limit,
        json=json,
        seed=seed,
        backbone=backbone,
    )


@app.command()
def ablation(
    data: Data,
    views: Annotated[list[str], typer.Option(help="As of bench pose; may be repeated.")] = ["10"],  # noqa: B006
    limit: Annotated[int, typer.Option(min=1, help="Pairs a category at most.")] = 12,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """What each part of the variant best adds to its accuracy."""
    from benchmarks.ablation import run

    run(data=data, views=views, limit=limit, json=json, seed=seed, backbone=backbone)


@app.command()
def paper(
    data: Data,
    limit: Annotated[int | None, typer.Option(min=1, help="Pairs a category at most.")] = None,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """The paper's tables 1 and 2, with every published row beside ours."""
    from benchmarks.paper import run

    run(data=data, limit=limit, json=json, seed=seed, backbone=backbone)


@app.command()
def discovery(
    data: Data,
    score: Annotated[list[str] | None, typer.Option(help="Score of the decision; may be repeated; all where left out.")] = None,
    episodes: Annotated[int, typer.Option(min=1, help="Orders in which objects are met.")] = 1000,
    length: Annotated[int, typer.Option(min=1, help="Objects met in an episode.")] = 250,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    poses: Annotated[bool, typer.Option(help="Verify by pose where there is depth: one solve for each pair of objects, cached.")] = True,
    plot: Plot = None,
    json: JsonFile = None,
) -> None:
    """How well known and novel objects are told apart."""
    from benchmarks.discovery import run

    run(data=data, scores=score or [], json=json, episodes=episodes, length=length, seed=seed, backbone=backbone, picture=plot, poses=poses)


@app.command()
def speed(
    data: Samples = None,
    views: Annotated[int, typer.Option(min=2, help="Views of the object and of the reference.")] = 10,
    rounds: Annotated[int, typer.Option(min=1, help="Times each operation is timed.")] = 5,
    backbone: Backbone = BACKBONE,
    device: Annotated[str, typer.Option(help="Torch device.")] = "cpu",
    plot: Annotated[Path | None, typer.Option(help="File for the stages, .png or .svg.")] = None,
    json: JsonFile = None,
) -> None:
    """Time of every stage of an observation."""
    from benchmarks.speed import run

    run(json=json, data=data, views=views, rounds=rounds, backbone=backbone, device=device, plot=plot)


@app.command()
def growth(
    categories: Annotated[list[int], typer.Option(help="Sizes of the memory, growing; may be repeated.")] = [10, 100, 1000, 10_000],  # noqa: B006
    views: Annotated[int, typer.Option(min=1, help="Of what is learnt and of what is looked at.")] = 10,
    rounds: Annotated[int, typer.Option(min=2, help="Decisions timed at each size.")] = 40,
    exact_up_to: Annotated[int, typer.Option(min=0, help="Categories up to which the exact rule is computed too.")] = 1000,
    data: Samples = None,
    backbone: Backbone = BACKBONE,
    seed: Seed = 0,
    plot: Plot = None,
    json: JsonFile = None,
) -> None:
    """Time of a decision, of a start, and memory, as a memory grows to many categories."""
    from benchmarks.growth import run
    from clients.cli.bench_growth import fill, measure

    run(
        fill=fill,
        measure=measure,
        json=json,
        plot=plot,
        categories=categories,
        views=views,
        rounds=rounds,
        exact_up_to=exact_up_to,
        data=data,
        backbone=backbone,
        seed=seed,
    )


@app.command()
def track(
    grid: Annotated[list[int], typer.Option(min=4, help="Patches a side of the close crop; may be repeated.")] = [16, 28],  # noqa: B006
    rate: Annotated[float, typer.Option(min=0.1, help="Frames a second of the camera.")] = 15,
    seconds: Annotated[float, typer.Option(min=1, help="For each service.")] = 20,
    data: Samples = None,
    json: JsonFile = None,
) -> None:
    """Sustained rate, latency and dropped frames of a followed object, from the last pose and solved anew each time."""
    from benchmarks.track import run
    from clients.cli.bench_track import serve

    run(serve=serve, json=json, grids=grid, rate_hz=rate, seconds=seconds, data=data)


@app.command()
def rendering(
    category: Categories = None,
    frames: Annotated[int, typer.Option(min=1, help="Frames of each object.")] = 12,
    seed: Seed = 0,
    json: JsonFile = None,
) -> None:
    """Frames a second of the simulated world."""
    from benchmarks.rendering import run

    run(json=json, categories=category or [], frames=frames, seed=seed)


@app.command("next-view")
def next_view(
    category: Categories = None,
    instances: Annotated[int, typer.Option(min=1, help="Objects met of each category.")] = 3,
    looks: Annotated[int, typer.Option(min=1, max=12, help="Views of one side with which an answer is first sought.")] = 2,
    rate: Annotated[float, typer.Option(help="False-known rate asked for.")] = 0.01,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """Whether one more view, from where an uncertain answer says, settles it: in the simulated world."""
    from benchmarks.next_view import run

    run(json=json, categories=category or [], instances=instances, looks=looks, rate=rate, seed=seed, backbone=backbone)


@app.command()
def load(
    robots: Annotated[list[int], typer.Option(min=1, help="Robots at once; may be repeated.")] = [1, 2, 4, 8, 16, 32],  # noqa: B006
    seconds: Annotated[float, typer.Option(min=1, help="For each number of robots.")] = 45,
    views: Annotated[int, typer.Option(min=1, help="Of an observation.")] = 4,
    data: Samples = None,
    url: Url = None,
    seed: Seed = 0,
    plot: Plot = None,
    json: JsonFile = None,
) -> None:
    """Throughput, times, queue, refusals and memory of a service that many robots ask at once."""
    from benchmarks.load import run

    run(json=json, plot=plot, robots=robots, seconds=seconds, views=views, data=data, url=url, seed=seed)


@app.command()
def soak(
    minutes: Annotated[float, typer.Option(min=0.1, help="How long.")] = 30,
    robots: Annotated[int, typer.Option(min=1, help="Robots at once.")] = 2,
    most_growth: Annotated[float, typer.Option(min=0, help="Share by which the settled process may grow; it exits with 1 above.")] = 0.05,
    views: Annotated[int, typer.Option(min=2, help="Of an observation.")] = 4,
    data: Samples = None,
    url: Url = None,
    seed: Seed = 0,
    plot: Plot = None,
    json: JsonFile = None,
) -> None:
    """Whether a service that works for long grows: resident memory, once settled and at the end."""
    from benchmarks.soak import run

    run(minutes=minutes, most_growth=most_growth, json=json, plot=plot, robots=robots, views=views, data=data, url=url, seed=seed)


@app.command()
def isolation(
    data: Data,
    source: Annotated[list[str] | None, typer.Option(help="Source of the foreground; may be repeated; all where left out.")] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Objects a category at most.")] = None,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """How well the object is told from its background, against silhouettes."""
    from benchmarks.isolation import SOURCES, run

    run(data=data, json=json, sources=source or SOURCES, limit=limit, backbone=backbone)


@app.command()
def symmetries(
    data: Data,
    views: Annotated[int, typer.Option(min=2, help="Views of each object, evenly spaced in its recording.")] = 10,
    limit: Annotated[int | None, typer.Option(min=1, help="Objects a category at most.")] = None,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """Whether symmetric objects are recognised, against the symmetries that the data declare."""
    from benchmarks.symmetries import run

    run(data=data, json=json, views=views, limit=limit, backbone=backbone)


@app.command()
def robustness(
    data: Data,
    views: Annotated[str, typer.Option(help="Views of what the memory holds and of the degraded burst: 8, 10+6 or all.")] = "8",
    limit: Annotated[int | None, typer.Option(min=1, help="Degraded objects a category at most; all others are references.")] = None,
    degradation: Annotated[list[str] | None, typer.Option(help='Such as "motion blur"; may be repeated; all where left out.')] = None,
    category: Annotated[list[str] | None, typer.Option(help="Of the degraded objects; may be repeated; all where left out.")] = None,
    strongest: Annotated[int | None, typer.Option(min=1, help="Only so many strengths of each, the strongest.")] = None,
    poses: Annotated[bool, typer.Option(help="Verify decisions by pose, as the service does.")] = True,
    plot: Annotated[Path | None, typer.Option(help="Folder for the curves.")] = None,
    seed: Seed = 0,
    backbone: Backbone = BACKBONE,
    json: JsonFile = None,
) -> None:
    """How much worse sensors and places may get; goes on where it was interrupted."""
    from benchmarks.robustness import run

    run(
        data=data,
        json=json,
        picture=plot,
        views=views,
        limit=limit,
        degradations=degradation or [],
        categories=category or [],
        strongest=strongest,
        seed=seed,
        backbone=backbone,
        poses=poses,
    )
