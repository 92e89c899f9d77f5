"""What the pose benchmark compares: the pipeline's variants, rotation without depth, and registration of bare clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any, Protocol

import numpy as np

from benchmarks.pairs import ViewCounts
from benchmarks.registration import DESCRIPTOR_SIZE, METHODS, register
from core.descriptors import component_count
from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.orientation import Appearance, OrientationConfig, estimate_orientation
from core.packing import burst_as_arrays
from core.pose import VARIANTS, PoseConfig, PoseEstimator, PoseOptions
from core.reference import Reference, build_reference
from core.sim3 import Sim3
from core.views import FloatArray

ESSENTIAL = "essential"
"""The name of rotation without depth."""
NAMES = (*VARIANTS, ESSENTIAL, *METHODS)


@dataclass(frozen=True, eq=False)
class Found:
    """As much of a target_from_reference as a contender gives."""

    rotation: FloatArray
    """Shape (3, 3)."""
    similarity: Sim3 | None
    """None where there is no scale."""
    matrix: FloatArray | None
    """The whole transform, which is 9-D where that was asked for and found, shape (4, 4)."""
    dof: int


class Contender(Protocol):
    """One way to find the pose of a target; small enough to travel between processes."""

    @property
    def variant(self) -> str: ...

    @property
    def dims(self) -> int:
        """Descriptor size."""
        ...

    @property
    def all_views(self) -> bool:
        """Takes every view there is, whatever number is asked for."""
        ...

    @property
    def options(self) -> PoseOptions:
        """Its settings; None for those that mean nothing to it."""
        ...

    def learn(self, scanned: EncodedBurst) -> tuple[Any, float]:
        """What it keeps of a reference, and how many megabytes that is."""
        ...

    def find(self, kept: Any, target: EncodedBurst, seed: int) -> Found:
        """Raises NoPose."""
        ...


def contender(name: str, options: PoseOptions, token_size: int) -> Contender:
    """By its name. Raises InvalidInput for an unknown one and for options that mean nothing to it."""
    if name == ESSENTIAL:
        _refuse(name, options, "dims", "method", "consensus_deg")
        chosen = {key: value for key, value in asdict(options).items() if value is not None}
        orientation = OrientationConfig(**chosen)
        return _Orientation(orientation, _described(orientation.dims, token_size))
    if name in METHODS:
        _refuse(name, options)
        return _Registration(name)
    if name not in VARIANTS:
        raise InvalidInput("variant", f"{name!r} is none of {', '.join(NAMES)}")
    config = PoseConfig.named(name, options)
    return _Pipeline(config, _described(config.dims, token_size))


def _described(dims: int | None, token_size: int) -> int:
    """Components that describe a patch: a small token has fewer than are asked for. Raises as `component_count` does."""
    return min(component_count(dims, token_size) or token_size, token_size)


@dataclass(frozen=True)
class Setting:
    """What one group of rows has in common."""

    views: ViewCounts
    contender: Contender


@dataclass(frozen=True)
class Sweep:
    """Which settings are run: every combination. An option left out is each variant's own."""

    variants: Sequence[str]
    """Of `NAMES`."""
    views: Sequence[str]
    """As in `ViewCounts.parse`. A variant for all views there are (`ucd+`) takes them all, once."""
    dims: Sequence[int] | None = None
    """Descriptor sizes."""
    methods: Sequence[str] | None = None
    """Of `core.correspond.METHODS`."""
    consensus_deg: Sequence[float] | None = None
    inlier_ratios: Sequence[float] | None = None
    estimators: Sequence[str] | None = None
    """Of `core.estimators.ESTIMATORS`."""
    dof: Sequence[int] | None = None
    """7 or 9."""

    def settings(self, token_size: int) -> list[Setting]:
        """In the order of the table. Raises InvalidInput for a name, a count or a size that does not exist."""
        counts = [ViewCounts.parse(text) for text in self.views]
        axes: list[Sequence[Any] | None] = [self.dims, self.methods, self.consensus_deg, self.inlier_ratios, self.estimators, self.dof]
        options = [PoseOptions(*each) for each in product(*(axis or [None] for axis in axes))]
        settings = []
        for variant in self.variants:
            contenders = [contender(variant, each, token_size) for each in options]
            for count, each in product([ViewCounts.all()] if contenders[0].all_views else counts, contenders):
                settings.append(Setting(count, each))
        return settings


def without_depth(encoded: EncodedBurst) -> EncodedBurst:
    """The same views, as if no depth had been measured."""
    return EncodedBurst(tuple(replace(view, points_m=np.full_like(view.points_m, np.nan)) for view in encoded.views), encoded.fingerprint)


def _refuse(name: str, options: PoseOptions, *meaningful: str) -> None:
    for key, value in asdict(options).items():
        if value is not None and key not in meaningful:
            raise InvalidInput(key, f"means nothing to {name}; leave it out")


@dataclass(frozen=True)
class _Pipeline:
    config: PoseConfig
    dims: int

    @property
    def variant(self) -> str:
        return self.config.variant

    @property
    def all_views(self) -> bool:
        return self.config.all_views

    @property
    def options(self) -> PoseOptions:
        config = self.config
        return PoseOptions(self.dims, config.method, config.consensus_deg, config.inlier_ratio, config.estimator, config.dof)

    def learn(self, scanned: EncodedBurst) -> tuple[Reference, float]:
        arrays = build_reference(scanned).as_arrays()
        return Reference.from_arrays(arrays), _megabytes(arrays)  # as the memory keeps it

    def find(self, kept: Reference, target: EncodedBurst, seed: int) -> Found:
        if self.config.solver == "pnp":
            target = without_depth(target)
        estimate = PoseEstimator(self.config).estimate(kept, target, seed=seed)
        similarity = estimate.target_from_reference
        return Found(similarity.rotation, similarity, estimate.matrix(kept.box), 7 if estimate.target_from_object is None else 9)


@dataclass(frozen=True)
class _Orientation:
    config: OrientationConfig
    dims: int
    variant: str = ESSENTIAL
    all_views: bool = False

    @property
    def options(self) -> PoseOptions:
        return PoseOptions(self.dims, self.config.method, self.config.consensus_deg, dof=5)

    def learn(self, scanned: EncodedBurst) -> tuple[Appearance, float]:
        blind = without_depth(scanned)
        return Appearance.of(blind), _megabytes(burst_as_arrays(blind))

    def find(self, kept: Appearance, target: EncodedBurst, seed: int) -> Found:
        return Found(estimate_orientation(kept, without_depth(target), self.config, seed=seed).rotation, None, None, 5)


@dataclass(frozen=True)
class _Registration:
    variant: str
    dims: int = DESCRIPTOR_SIZE
    all_views: bool = False

    @property
    def options(self) -> PoseOptions:
        return PoseOptions(self.dims, dof=7)

    def learn(self, scanned: EncodedBurst) -> tuple[EncodedBurst, float]:
        return scanned, scanned.cloud_m.nbytes / 1e6

    def find(self, kept: EncodedBurst, target: EncodedBurst, seed: int) -> Found:
        similarity = register(kept, target, self.variant, seed)
        return Found(similarity.rotation, similarity, similarity.as_matrix(), 7)


def _megabytes(arrays: dict[str, Any]) -> float:
    return sum(array.nbytes for array in arrays.values()) / 1e6
