"""One pair of objects under one number of views: a unit of work for benchmarks that look into single estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.encoded import encode_all, read_views
from benchmarks.pairs import Pair, ViewCounts, choose_views, require_views, sample_pairs
from clients.datasets.folders import Sequence as Recording
from clients.datasets.sources import find_sequences
from clients.pose_error import rotation_error_deg
from core.encode import EncodedBurst, Encoder
from core.pose_estimate import PoseEstimate
from core.reference import Reference, build_reference


@dataclass(frozen=True)
class PairJob:
    """A reference, a target, and how many views there are of each."""

    pair: Pair
    files: tuple[Path, Path]
    """Their encoded views."""
    views: ViewCounts
    seed: int

    def reference(self) -> Reference:
        """Built from the first object's views."""
        return build_reference(self._seen(0, "reference", self.views.reference))

    def target(self) -> EncodedBurst:
        """The second object's views."""
        return self._seen(1, "target", self.views.target)

    def errors_deg(self, estimate: PoseEstimate) -> list[float]:
        """Rotation errors of an estimate and of its alternatives, in order, degrees."""
        of_reference, of_target = (sequence.world_from_model for sequence in self.pair)
        assert of_reference, "sample_pairs requires ground truth"
        assert of_target, "sample_pairs requires ground truth"
        transforms = [estimate.target_from_reference, *(each.target_from_reference for each in estimate.alternatives)]
        return [rotation_error_deg(each.rotation, of_reference, of_target, self.pair[1].symmetries) for each in transforms]

    def _seen(self, side: int, role: str, count: int | None) -> EncodedBurst:
        return seen_views(self.pair[side], self.files[side], role, count, self.seed)


def pair_jobs(data: Path | str, views: Sequence[str], limit: int, seed: int, encoder: Encoder) -> list[PairJob]:
    """A job for each sampled pair and each of `views`, encoding what is not yet.

    Raises InvalidInput for bad view counts, or data without pairs, ground truth or enough views.
    """
    counts = list(dict.fromkeys(map(ViewCounts.parse, views)))
    pairs = sample_pairs(find_sequences(data), limit, seed)
    require_views([sequence for pair in pairs for sequence in pair], counts)
    files = encode_pairs(pairs, encoder)
    return [PairJob((a, b), (files[a.key], files[b.key]), count, seed) for count in counts for a, b in pairs]


def encode_pairs(pairs: Sequence[Pair], encoder: Encoder) -> dict[str, Path]:
    """The encoded views of each sequence of the pairs, by its key."""
    sequences = list(dict.fromkeys(sequence for pair in pairs for sequence in pair))
    return {sequence.key: file for sequence, file in zip(sequences, encode_all(sequences, encoder), strict=True)}


def seen_views(sequence: Recording, file: Path, role: str, count: int | None, seed: int) -> EncodedBurst:
    """The views that stand for a sequence as `reference` or `target`."""
    return read_views(file, choose_views(sequence.name, role, len(sequence.images), count, seed))
