"""Which pairs and views a benchmark takes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benchmarks.pairs import ViewCounts, choose_views, sample_pairs
from clients.datasets.folders import Sequence
from core.errors import InvalidInput
from core.sim3 import Sim3


def sequence(category: str, instance: str, truth: Sim3 | None = None) -> Sequence:
    """A recording without files."""
    return Sequence(Path(category) / instance, category, instance, (), truth, ())


SIX_PAIRS = [sequence("cup", name, Sim3.identity()) for name in "abc"]


def test_all_ordered_pairs_of_different_instances() -> None:
    pairs = sample_pairs([*SIX_PAIRS, sequence("car", "only", Sim3.identity())], limit=100, seed=0)
    assert Counter(a.instance + b.instance for a, b in pairs) == Counter(["ab", "ac", "ba", "bc", "ca", "cb"])
    assert all(a.category == b.category == "cup" and a.instance != b.instance for a, b in pairs)


def test_a_smaller_limit_is_a_prefix_whatever_else_is_there() -> None:
    more = [sequence("car", name, Sim3.identity()) for name in "xy"]
    few, many = sample_pairs(SIX_PAIRS, 2, seed=3), sample_pairs(SIX_PAIRS + more, 5, seed=3)
    assert [pair for pair in many if pair[0].category == "cup"][:2] == few


def test_pairs_need_ground_truth_and_two_instances() -> None:
    with pytest.raises(InvalidInput, match=r"scene_gt\.json"):
        sample_pairs([*SIX_PAIRS, sequence("cup", "d")], 100, seed=0)
    with pytest.raises(InvalidInput, match="no category has two instances"):
        sample_pairs(SIX_PAIRS[:1], 100, seed=0)


def test_views_are_evenly_spaced_around_the_recording() -> None:
    four = choose_views("cup/a", "target", 16, 4, seed=0)
    assert set(np.diff(four)) == {4}
    ten = choose_views("cup/a", "target", 16, 10, seed=0)
    assert len(set(ten)) == 10
    assert set(np.diff([*ten, ten[0] + 16])) == {1, 2}


def test_where_the_views_begin_depends_on_role_and_seed() -> None:
    choices = [choose_views("cup/a", role, 1000, 8, seed) for role in ("reference", "target") for seed in (0, 1)]
    assert len({tuple(choice) for choice in choices}) == 4


@pytest.mark.parametrize(("text", "reference", "target"), [("10", 10, 10), ("10+3", 10, 3), ("1+1", 1, 1)])
def test_view_counts_are_of_both_or_of_each(text: str, reference: int, target: int) -> None:
    assert ViewCounts.parse(text) == ViewCounts(text, reference, target)


@pytest.mark.parametrize("text", ["", "ten", "10+", "0", "3+0", "1+2+3", "-4"])
def test_what_is_no_view_count_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="expected a count such as 10"):
        ViewCounts.parse(text)
