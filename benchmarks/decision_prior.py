"""Makes the figures that stand in for a memory's own while it holds little: `python -m benchmarks.decision_prior --data DIR`.

Every burst below DIR is taken out in turn and compared with all others: with its own category (by other instances of it), and with the
rest as if its own were not there; all of the rest are its cohort. A memory that holds little has nothing to adapt to, so nothing is adapted
here either. The shipped file is made from the sample bursts.

Letters: N bursts.
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
from core.errors import InvalidInput
from core.evidence import MEMBERS, Comparison, Matched, Usual
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
    """Writes the figures to `out`, and returns it.

    Args:
        labels: the category of each burst, shape (N,): two or more, one of them with two bursts.
        match: matches of all pairs, shape (N, N).
        agreement: of the reference of burst i with burst j at the best pose, shape (N, N); all bursts need depth, cameras and two views.
    """
    founders = [_founders(labels, burst) for burst in range(len(labels))]
    others = np.array(
        [match[founder, burst] for burst, each in enumerate(founders) for kind, founder in each.items() if kind != labels[burst]]
    )
    usual = Usual(round(float(others.mean()), 4), round(float(others.std()), 4))
    wrong: list[list[tuple[float, float]]] = []
    own: list[tuple[float, float]] = []
    for burst, oldest in enumerate(founders):
        found = {each: _evidence(match, labels, oldest, burst, each, usual) for each in oldest}
        by_pose = {each: agreement[founder, burst] for each, founder in oldest.items()}
        wrong.append([(found[each], by_pose[each]) for each in found if each != labels[burst]])
        own += [(found[each], by_pose[each]) for each in found if each == labels[burst]]
    if not all(np.isfinite(pose) for pairs in [own, *wrong] for _, pose in pairs):
        raise InvalidInput("--data", "holds bursts of one view, or without depth or cameras, which have no poses; leave them out")
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


def _evidence(match: FloatArray, labels: NDArray[np.intp], founders: dict[int, int], burst: int, category: int, usual: Usual) -> float:
    """Evidence of a burst for a category, all other bursts being in the memory, but of its own category only if that is asked about."""
    own = labels[burst]

    def cohort(each: int) -> dict[str, float]:
        return {str(other): float(match[founder, each]) for other, founder in founders.items()}

    members = sorted(_others(labels, burst, category), key=lambda index: -match[index, burst])[:MEMBERS]
    matched = {str(category): [Matched(float(match[member, burst]), cohort(member)) for member in members]}
    ((_, evidence),) = Comparison(matched, cohort(burst), usual).ranked(without=None if category == own else str(own))
    return evidence


def _others(labels: NDArray[np.intp], burst: int, category: int) -> list[int]:
    """The bursts of a category, without the one that is compared."""
    return [int(index) for index in np.flatnonzero(labels == category) if index != burst]


def _founders(labels: NDArray[np.intp], burst: int) -> dict[int, int]:
    """The first burst of each category, as if the burst that is compared were not there."""
    others = {each: _others(labels, burst, each) for each in sorted(set(labels.tolist()))}
    return {each: bursts[0] for each, bursts in others.items() if bursts}


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(float(value), 4) for value in values]


if __name__ == "__main__":
    typer.run(main)
