"""What the choices of `core.evidence` are worth, one varied at a time: `python -m benchmarks.evidence_ablation --data DIR --json FILE`.

Between objects, as if each were a category of its own, by tokens alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from benchmarks.best_pairs import single_evidence
from benchmarks.encoded import encode_all, read_views
from benchmarks.episodes import labels_of
from benchmarks.matches import STAGES, adapted, match_table
from benchmarks.pair_scores import auroc, nearest_accuracy, same_and_other
from benchmarks.parallel import map_jobs
from benchmarks.tables import Row, print_table, write_json
from clients.datasets.sources import find_sequences
from core.backbones import load_backbone
from core.backbones.whitening import Whitening
from core.calibration import Prior
from core.encode import EncodedBurst, Encoder
from core.evidence import DEVIATIONS, PARTS, part_tokens, whitened
from core.views import FloatArray

COLUMNS = ("change", "auroc", "nearest")


@dataclass(frozen=True)
class Choice:
    """One setting of the evidence."""

    parts: int = PARTS
    """Of a view."""
    drawn: bool = False
    """Whether in their place as many patches are drawn at random."""
    adapted: int = STAGES[-1]
    """Objects, drawn at random, that the statistics adapt to."""
    deviations: float = DEVIATIONS


@dataclass(frozen=True)
class Job:
    """The table of matches that a choice needs."""

    files: tuple[Path, ...]
    whitening: Whitening | None
    choice: Choice


def main(
    data: Annotated[str, typer.Option(help="Recorded objects, as of onelook bench discovery.")],
    json: Annotated[Path | None, typer.Option(help="File for the table.")] = None,
) -> None:
    """Prints a table, today's choice first."""
    backbone = load_backbone(report=typer.echo)
    sequences = find_sequences(data)
    files = tuple(encode_all(sequences, Encoder(backbone)))
    labels = labels_of(sequences)
    choices = varied(len(files))
    tables = dict.fromkeys(replace(choice, deviations=DEVIATIONS) for choice in choices.values())
    matches = dict(
        zip(tables, map_jobs(table, [Job(files, backbone.whitening, choice) for choice in tables], lambda job: 1, "matching parts"))
    )
    rows = [row(name, matches[replace(choice, deviations=DEVIATIONS)], choice.deviations, labels) for name, choice in choices.items()]
    if json is not None:
        write_json(json, {"benchmark": "evidence_ablation", "data": data, "sequences": len(files)}, rows)
    print_table(f"Evidence, {data}", rows, COLUMNS)


def varied(objects: int) -> dict[str, Choice]:
    """Choices by their names."""
    today = Choice()
    return {
        "today's": today,
        **{f"parts of a view: {count}": replace(today, parts=count) for count in (1, 3, 6, 24)},
        **{f"patches of a view, drawn at random: {count}": replace(today, parts=count, drawn=True) for count in (12, 24, 96)},
        **{f"statistics of objects: {count}": replace(today, adapted=count) for count in (0, 8, objects)},
        **{f"deviations: {each}": replace(today, deviations=each) for each in (0.0, 1.0, 2.0, 4.0)},
    }


def table(job: Job) -> FloatArray:
    """Matches of all pairs, shape (N, N)."""
    kept = drawn_patches if job.choice.drawn else part_tokens
    tokens = [whitened(kept(read_views(file), job.choice.parts), job.whitening) for file in job.files]
    return match_table(tokens, adapted(tokens, job.choice.adapted))


def drawn_patches(encoded: EncodedBurst, patches: int) -> FloatArray:
    """Tokens of random foreground patches of each view, shape (V, K = patches, D); where a view has fewer they are repeated."""
    rng = np.random.default_rng(0)
    shown = [view.descriptors for view in encoded.views if len(view.descriptors)]
    return np.stack([tokens[rng.permutation(len(tokens))[np.arange(patches) % len(tokens)]] for tokens in shown])


def row(name: str, matches: FloatArray, deviations: float, labels: NDArray[np.intp]) -> Row:
    """One line of the table, from matches of all pairs, shape (N, N), and the category of each burst, shape (N,)."""
    single = single_evidence(matches, Prior.shipped(), deviations)
    return dict(zip(COLUMNS, (name, auroc(*same_and_other(single, labels)), nearest_accuracy(single, labels))))


if __name__ == "__main__":
    typer.run(main)
