"""Growth: what a decision, a start and the memory take as categories come, by default from ten to ten thousand.

The store is a real one: rows as the service writes them, without pictures and references, which a decision by tokens does not read. It
grows from size to size, and at each a new process opens it and decides as the service does. The tokens are `benchmarks.synthetic_tokens`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.encoded import encode_all, read_views
from benchmarks.episodes import labels_of
from benchmarks.growth_plot import plot_growth
from benchmarks.parallel import bar
from benchmarks.synthetic_tokens import Levels, SyntheticTokens
from benchmarks.tables import print_table, report
from clients.datasets.samples import data_or_samples
from clients.datasets.sources import find_sequences
from core.backbones import EMBEDDED, load_backbone
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst, Encoder
from core.errors import InvalidInput

ASKED = 1
"""Instance of a category that is looked at; the one that the memory holds is 0."""
LEVELS = ("bursts", *(field.name for field in fields(Levels)))
"""Columns of how well bursts match."""


@dataclass(frozen=True, eq=False)
class Probe:
    """What is measured in a process of its own, on the memory as it is."""

    folder: Path
    known: Sequence[EncodedBurst]
    """Of categories that the memory holds."""
    right: Sequence[int]
    """Which categories these are, counted from the first learnt."""
    novel: EncodedBurst
    """Of none; the memory learns it in the end."""
    whitening: Whitening
    """That the tokens were drawn with."""
    rounds: int
    exact: bool
    """Whether the exact rule is computed too, which compares each burst with all members part by part."""


@dataclass(frozen=True)
class GrowthRow:
    """One size of the memory."""

    categories: int
    exact: bool
    """Whether the service compares every member part by part at this size."""
    decide_ms: float
    least_ms: float
    p95_ms: float
    """A decision on an object that was decided on before: median, the quickest, which other work on the machine disturbs least, and p95."""
    nearest_ms: float
    """Of it, the product with all pooled means."""
    store_ms: float
    """Of it, what is asked of the store: whether members have changed, and the latest decisions."""
    new_ms: float
    """A decision on an object whose like was not looked at since the start: its neighbours are read."""
    learnt_ms: float
    """The first decision after a category was learnt."""
    first_ms: float
    """The first decision after the start."""
    open_ms: float
    """Until the memory is open."""
    open_read_mb: float
    first_read_mb: float
    """Read from files by then, and by the first decision."""
    file_mb: float
    """Of tokens and rows on the disk."""
    resident_mb: float
    """After all decisions, beyond a process that has no memory open."""
    right: float
    """Decisions whose most similar category is the right one."""
    recall: float | None
    """Decisions for which the exact rule finds the same category most similar."""
    evidence_off: float | None
    """Mean distance of its similarity from the exact one."""
    exact_spread: float | None
    """Standard deviation of the exact similarities, to compare with."""


Fill = Callable[[Path, Iterable[EncodedBurst]], None]
"""Adds a category for each burst to the memory in a folder, which is made where it is missing."""
Measure = Callable[[Probe], GrowthRow]


def run(
    fill: Fill,
    measure: Measure,
    json: Path | None,
    plot: Path | None,
    *,
    categories: Sequence[int],
    views: int,
    rounds: int,
    exact_up_to: int,
    data: Path | None,
    backbone: str,
    seed: int,
) -> list[GrowthRow]:
    """A row for each size; prints a table.

    Args:
        fill: how a memory is filled, and `measure` how one is asked: both are the store's business, and this package knows no store.
        rounds: decisions timed at each size.
        exact_up_to: categories up to which the exact rule is computed as well, in time that grows with their number.

    Raises InvalidInput where sizes do not grow or the backbone ships no statistics, and of `data` as `labels_of` does.
    """
    if list(categories) != sorted(set(categories)) or categories[0] < 1:
        raise InvalidInput("categories", f"expected growing numbers, found {', '.join(map(str, categories))}")
    tokens, recorded, synthetic = synthetic_tokens(data, backbone, seed)
    rng, rows, before = np.random.default_rng(seed), [], 0
    with TemporaryDirectory() as folder, bar() as progress:
        task = progress.add_task("learning", total=sum(np.diff([0, *categories])))
        for count in categories:
            progress.update(task, description=f"{count} categories")
            fill(Path(folder), (_told(tokens, each, views, lambda: progress.advance(task)) for each in range(before, count)))
            right = rng.integers(0, count, rounds).tolist()
            asked, novel = [tokens.burst(category, ASKED, views) for category in right], tokens.burst(10**9 + count, ASKED, views)
            rows.append(measure(Probe(Path(folder), asked, right, novel, tokens.whitening, rounds, count <= exact_up_to)))
            before = count
    meta = {"benchmark": "growth", "views": views, "rounds": rounds, "seed": seed}
    match = {"recorded": asdict(recorded), "synthetic": asdict(synthetic)}
    print_table("How well bursts match", [{"bursts": bursts, **levels} for bursts, levels in match.items()], LEVELS)
    report(f"Growth, {views} views a burst, {rounds} decisions", rows, meta | match, json)
    if plot is not None:
        plot_growth(plot, rows, f"{views} views a burst, one burst a category")
    return rows


def synthetic_tokens(data: Path | None, backbone: str, seed: int) -> tuple[SyntheticTokens, Levels, Levels]:
    """Like the bursts of `data`, the samples where None; and how bursts match, recorded and synthetic."""
    network = load_backbone(backbone)
    if network.whitening is None:
        raise InvalidInput("backbone", f"{backbone} ships no statistics of its tokens to draw from; take {EMBEDDED}")
    sequences = find_sequences(data_or_samples(data))
    labels = labels_of(sequences)
    files = encode_all(sequences, Encoder(network))
    recorded = [(str(label), read_views(file)) for label, file in zip(labels, files)]
    return SyntheticTokens.like(recorded, network.whitening, seed)


def _told(tokens: SyntheticTokens, category: int, views: int, tell: Callable[[], None]) -> EncodedBurst:
    tell()
    return tokens.burst(category, 0, views)
