"""Makes the figures that stand in for a memory's own while it holds little: `python -m benchmarks.decision_prior --data DIR`.

Every burst below DIR is taken out in turn and compared with all others: with its own category (by other instances of it), and with the
rest as if its own were not there. A memory that holds little has nothing to adapt to, so nothing is adapted here either. The shipped file
is made from the sample bursts.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from benchmarks.agreements import agreements
from benchmarks.encoded import encode_all, read_views
from benchmarks.episodes import labels_of
from benchmarks.matches import matches
from benchmarks.parallel import bar
from clients.datasets.folders import find_sequences
from core.backbones import load_backbone
from core.calibration import SHIPPED
from core.encode import Encoder
from core.evidence import MEMBERS, Usual, cohort_level
from core.views import FloatArray


def main(data: Annotated[Path, typer.Option(help="folder of bursts")], out: Annotated[Path, typer.Option()] = SHIPPED) -> None:
    """Writes how bursts match other categories, what an agreement is worth, and samples of evidence for right and wrong categories."""
    backbone = load_backbone(report=typer.echo)
    sequences = find_sequences(data)
    files = encode_all(sequences, Encoder(backbone))
    with bar() as progress:
        bursts = [read_views(file) for file in progress.track(files, description="reading")]
    labels = labels_of(sequences)
    match, agreement = matches(bursts, backbone.whitening)[0], agreements(files, backbone.whitening)
    typer.echo(f"wrote {write(out, backbone.fingerprint, labels, match, agreement)}")


def write(out: Path, fingerprint: str, labels: NDArray[np.intp], match: FloatArray, agreement: FloatArray) -> Path:
    """From the category of each burst, shape (N,), and matches and agreements of all pairs, each (N, N)."""
    others = np.concatenate([match[_founders(labels, x, labels[x]), x] for x in range(len(labels))])
    usual = Usual(round(float(others.mean()), 4), round(float(others.std()), 4))
    wrong: list[list[tuple[float, float]]] = []
    own: list[tuple[float, float]] = []
    for x in range(len(labels)):
        found = {c: _evidence(match, labels, x, c, usual) for c in set(labels.tolist()) if _others(labels, x, c)}
        founder = {c: agreement[_others(labels, x, c)[0], x] for c in found}
        wrong.append([(found[c], founder[c]) for c in found if c != labels[x]])
        own += [(found[c], founder[c]) for c in found if c == labels[x]]
    tokens, poses = (np.array([pair[part] for pairs in wrong for pair in pairs]) for part in (0, 1))
    weight = float(tokens.std() / poses.std())

    def samples(weight: float) -> dict[str, list[float]]:
        rivals = [max(token + weight * pose for token, pose in pairs) for pairs in wrong]
        return {"rivals": _rounded(rivals), "own": _rounded([token + weight * pose for token, pose in own])}

    fields = {
        "fingerprint": fingerprint,
        "usual": asdict(usual),
        "agreement_weight": round(weight, 3),
        "tokens": samples(0.0),
        "verified": samples(weight),
    }
    out.write_text(json.dumps(fields, indent=1) + "\n")
    return out


def _evidence(match: FloatArray, labels: NDArray[np.intp], x: int, category: int, usual: Usual) -> float:
    """Of burst x for a category, all bursts but x being in the memory and its own category only where it is the one asked about."""
    members = sorted(_others(labels, x, category), key=lambda index: -match[index, x])[:MEMBERS]
    founders = [f for f in _founders(labels, x, category) if labels[f] != labels[x]]
    of_burst, *of_members = (float(cohort_level(match[founders, each], usual)) for each in (x, *members))
    return float(np.mean([match[member, x] - (of_burst + level) / 2 for member, level in zip(members, of_members)]))


def _others(labels: NDArray[np.intp], x: int, category: int) -> list[int]:
    return [int(index) for index in np.flatnonzero(labels == category) if index != x]


def _founders(labels: NDArray[np.intp], x: int, without: int) -> list[int]:
    return [_others(labels, x, c)[0] for c in sorted(set(labels.tolist())) if c != without and _others(labels, x, c)]


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(float(value), 4) for value in values]


if __name__ == "__main__":
    typer.run(main)
