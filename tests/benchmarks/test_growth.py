"""The growth bench: its tokens are like recorded ones, and it asks the memory that it filled."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import growth
from benchmarks.growth import GrowthRow, Probe, synthetic_tokens
from benchmarks.synthetic_tokens import Levels, SyntheticTokens
from clients.cli.bench_growth import exact_best, fill
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.evidence import PARTS, whitened
from core.novelty import decide
from store.memory import Memory

DIM = 32
WHITENING = Whitening.fit(np.random.default_rng(0).normal(size=(2000, DIM)) * np.linspace(0.3, 2, DIM) + 0.5)
TOKENS = SyntheticTokens(
    WHITENING, np.linalg.inv(WHITENING.matrix), np.eye(DIM) * 0.5, np.eye(DIM) * 0.2, 0.1, np.eye(DIM) * 0.5, 0.7, 0.5, 0
)
LEVELS = Levels(0.3, 0.1, 0.02)


def test_the_same_instance_is_the_same_tokens_and_no_other_is() -> None:
    burst = TOKENS.burst(3, 0, 4)
    assert np.array_equal(burst.pooled, TOKENS.burst(3, 0, 4).pooled)
    assert not np.array_equal(burst.pooled, TOKENS.burst(3, 1, 4).pooled)
    assert [view.descriptors.shape for view in burst.views] == [(PARTS, DIM)] * 4


def test_raw_tokens_are_whitened_to_what_was_drawn() -> None:
    view = TOKENS.burst(5, 0, 2).views[1]
    np.testing.assert_allclose(whitened(view.descriptors, WHITENING), TOKENS.parts(5, 0, 2)[1], atol=1e-3)
    np.testing.assert_allclose(view.pooled, TOKENS.parts(5, 0, 2)[1].mean(axis=0), atol=1e-3)


def test_bursts_of_a_category_match_better_than_others() -> None:
    found = TOKENS.levels()
    assert found.same > found.other + found.other_spread


def test_shares_are_chosen_such_that_bursts_match_as_recorded() -> None:
    recorded = [(f"{category}", TOKENS.burst(category, instance, 6)) for category in range(8) for instance in range(2)]
    _, real, made = SyntheticTokens.like(recorded, WHITENING, seed=1)
    assert made.same == pytest.approx(real.same, abs=0.03)
    assert made.other == pytest.approx(real.other, abs=0.05)


def test_a_burst_of_one_view_says_nothing_of_how_views_differ() -> None:
    recorded = [(f"{category}", TOKENS.burst(category, instance, 6)) for category in range(8) for instance in range(2)]
    _, real, made = SyntheticTokens.like([*recorded, ("0", TOKENS.burst(0, 2, 1))], WHITENING, seed=1)
    assert made.same == pytest.approx(real.same, abs=0.03)


def test_recordings_of_one_kind_are_refused(recorded: Path, small_world: Any, backbone: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    small_world(growth)
    monkeypatch.setattr(backbone, "whitening", WHITENING)
    with pytest.raises(InvalidInput, match="two categories") as caught:
        synthetic_tokens(recorded, "colour", seed=0)
    assert caught.value.field == "data"


def test_each_size_is_asked_after_it_was_filled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(growth, "synthetic_tokens", lambda data, backbone, seed: (TOKENS, LEVELS, LEVELS))
    filled: list[int] = []
    probes: list[Probe] = []

    def fill(folder: Path, bursts: Iterable[EncodedBurst]) -> None:
        filled.append(sum(1 for _ in bursts))

    def measure(probe: Probe) -> GrowthRow:
        probes.append(probe)
        figures = dict.fromkeys((field.name for field in fields(growth.GrowthRow)), 1.0) | {"categories": sum(filled), "exact": True}
        return GrowthRow(**figures)

    run = partial(growth.run, fill, measure, views=2, rounds=3, exact_up_to=2, data=None, backbone="colour", seed=0)
    rows = run(tmp_path / "growth.json", tmp_path / "growth.png", categories=(2, 5))
    assert filled == [2, 3]
    assert [row.categories for row in rows] == [2, 5]
    assert [probe.exact for probe in probes] == [True, False]
    assert all(probe.whitening is WHITENING for probe in probes)
    assert all(len(probe.known) == 3 and max(probe.right) < count for probe, count in zip(probes, (2, 5)))
    assert {file.name for file in tmp_path.iterdir()} == {"growth.json", "growth.png"}
    with pytest.raises(InvalidInput, match="growing"):
        run(None, None, categories=(5, 2))


def test_a_memory_compared_member_by_member_decides_as_the_exact_rule(tmp_path: Path) -> None:
    fill(tmp_path, (TOKENS.burst(category, 0, 3) for category in range(40)))
    asked = [TOKENS.burst(category, 1, 3) for category in (0, 20, 39)]
    with Memory.open(tmp_path) as memory:
        found = [decide(memory.instances.enrolled(WHITENING), burst).similarities[0] for burst in asked]
        exact = exact_best(memory, asked, WHITENING)
    assert [category for category, _ in found] == [category for category, _ in exact]
    assert [similarity for _, similarity in found] == pytest.approx([similarity for _, similarity in exact], abs=1e-4)
