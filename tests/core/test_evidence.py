"""Matches and cohorts computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from core.descriptors import unit
from core.evidence import (
    ADAPTATION_PRIOR,
    COHORT,
    COHORT_PRIOR,
    DEVIATIONS,
    PARTS,
    Adaptation,
    Comparison,
    Entry,
    Usual,
    cohort_level,
    match_views,
    merged,
    part_tokens,
)

from .conftest import PaintedObject

AXES = torch.eye(6)
USUAL = Usual(0.2, 0.05)


def views(*parts: list[int]) -> torch.Tensor:
    """One view for each list, whose parts are the axes of these numbers, shape (V, K, 6)."""
    return torch.stack([AXES[each] for each in parts])


def test_a_view_matches_by_its_parts_and_a_burst_by_its_best_views() -> None:
    assert match_views(views([0, 1]), [views([0, 1])])[0] == 1
    assert match_views(views([0, 1]), [views([0, 2])])[0] == 0.5
    # The second view finds nothing; the first finds its like, and the other side's only view finds it too.
    assert match_views(views([0, 1], [4, 5]), [views([0, 1])])[0] == pytest.approx((1 + (1 + 0) / 2) / 2)


def test_many_bursts_are_matched_as_one_after_the_other() -> None:
    generator = torch.Generator().manual_seed(0)
    others = [torch.nn.functional.normalize(torch.randn(1 + index % 3, 5, 6, generator=generator), dim=-1) for index in range(40)]
    together = match_views(others[0], others)
    np.testing.assert_allclose(together, [match_views(others[0], [other])[0] for other in others], atol=1e-6)
    np.testing.assert_allclose(together, [match_views(other, [others[0]])[0] for other in others], atol=1e-6)


def test_a_match_speaks_above_the_mean_and_deviations_of_the_cohort_beside_what_ships() -> None:
    usual = Usual(0.5, 0.1)
    assert cohort_level(np.zeros((3, 0)), usual).tolist() == pytest.approx([0.5 + DEVIATIONS * 0.1] * 3)
    assert cohort_level(np.array([0.6, 0.4, -np.inf]), usual) == pytest.approx(0.5 + DEVIATIONS * 0.1)
    many = np.random.default_rng(0).normal(0.2, 0.03, size=4000)
    assert cohort_level(many, usual) == pytest.approx(0.2 + DEVIATIONS * 0.03, abs=0.01)
    one = (1 + COHORT_PRIOR * 0.5) / (1 + COHORT_PRIOR)
    assert cohort_level(np.array([1.0]), usual, deviations=0) == pytest.approx(one)


def test_only_the_oldest_categories_are_the_cohort() -> None:
    """Whatever the rest are, the evidence is the same."""
    generator = torch.Generator().manual_seed(0)
    parts = [torch.nn.functional.normalize(torch.randn(2, 3, 6, generator=generator), dim=-1) for _ in range(COHORT + 20)]
    entries = [Entry(f"{index}", each) for index, each in enumerate(parts)]
    far = [Entry(entry.category_id, -parts[0][:1]) for entry in entries[COHORT:]]
    asked = parts[3] + 0.01
    found = [dict(Comparison.between(asked, entries[:COHORT] + rest, USUAL).ranked())["3"] for rest in ([], far, entries[COHORT:])]
    assert found[1:] == pytest.approx([found[0]] * 2)


def test_two_members_that_match_say_more_than_one_by_chance() -> None:
    asked = views([0, 1, 2, 3])
    chance = [Entry("chance", views([0, 1, 2, 3])), Entry("chance", views([4, 5, 4, 5]))]
    like = [Entry("like", views([0, 1, 2, 4]))] * 2
    ranked = Comparison.between(asked, [*chance, *like, Entry("other", views([5, 5, 5, 5]))], USUAL).ranked()
    assert ranked[0][0] == "like"


def test_the_mean_is_shrunk_towards_what_ships() -> None:
    rng = np.random.default_rng(0)
    bursts = [value + rng.normal(scale=1e-3, size=(2, 8, 4)) for value in (1.0, 3.0)]
    np.testing.assert_allclose(Adaptation.fit(bursts).mean, 4 / (2 + ADAPTATION_PRIOR), atol=0.01)


def test_many_bursts_flatten_what_they_have_in_common() -> None:
    """One direction varies a hundred times as much as the others, alike in all bursts: it is worth less afterwards."""
    rng = np.random.default_rng(0)
    spread = np.array([10.0, 1, 1, 1])
    bursts = [5 + spread * rng.normal(size=(4, 24, 4)) for _ in range(60)]
    adaptation = Adaptation.fit(bursts)
    adapted = (np.concatenate(bursts).reshape(-1, 4) - adaptation.mean) @ adaptation.matrix
    assert adapted.std(axis=0)[0] < 0.7 * spread[0] * adapted.std(axis=0)[1:].max()
    none = Adaptation.none(4)
    np.testing.assert_allclose(none.directions(bursts[0]).numpy(), unit(bursts[0]), atol=1e-5)


def test_what_resembles_everything_is_no_evidence() -> None:
    """A hub matches the burst best of all, but matches every other category as well."""
    everything = views([0, 1, 2, 3, 4, 5])
    entries = [Entry("hub", everything), *(Entry(f"{axis}", views([axis] * 6)) for axis in range(6))]
    ranked = Comparison.between(views([0, 0, 0, 0, 0, 1]), entries, USUAL).ranked()
    assert ranked[0][0] == "0"
    assert dict(ranked)["0"] > dict(ranked)["hub"]


def test_a_category_left_out_is_as_if_it_were_not_there() -> None:
    entries = [Entry(f"{axis}", views([axis, (axis + 1) % 6])) for axis in range(4)]
    asked = views([0, 1])
    assert Comparison.between(asked, entries, USUAL).ranked(without="0") == Comparison.between(asked, entries[1:], USUAL).ranked()


def test_a_memory_of_one_category_is_judged_by_what_ships() -> None:
    """One view a side, one member, no other category; and with the only one left out there is nothing to rank."""
    alone = Comparison.between(views([0, 1]), [Entry("only", views([0, 2]))], USUAL)
    assert alone.ranked() == [("only", pytest.approx(0.5 - (USUAL.mean + DEVIATIONS * USUAL.deviation)))]
    assert alone.ranked(without="only") == []


def test_a_view_is_kept_as_its_parts(painted: PaintedObject) -> None:
    burst = painted.encode(3)
    parts = part_tokens(burst)
    assert parts.shape == (3, PARTS, 48)
    np.testing.assert_array_equal(parts[1], merged(burst.views[1].descriptors))
    length = torch.linalg.vector_norm(Adaptation.none(48).directions(parts.astype(np.float32)), dim=-1)
    torch.testing.assert_close(length, torch.ones(3, PARTS))


def test_patches_that_look_alike_are_one_part() -> None:
    near = np.random.default_rng(0).normal(size=(40, 6)) * 0.01
    tokens = near + np.repeat(np.eye(6)[:4], 10, axis=0)
    expected = tokens.reshape(4, 10, 6).mean(axis=1)
    found = merged(tokens[np.random.default_rng(1).permutation(40)], 4)
    np.testing.assert_allclose(sorted(found.tolist()), sorted(expected.tolist()), atol=1e-3)


@pytest.mark.parametrize("tokens", [np.ones((1, 6)), np.ones((3, 6)), np.eye(6)[:2]])
def test_a_view_of_fewer_patches_than_parts_repeats_them(tokens: np.ndarray) -> None:
    found = merged(tokens)
    assert found.shape == (PARTS, 6)
    assert {tuple(part) for part in found.tolist()} == {tuple(token) for token in tokens.tolist()}


def test_of_a_view_of_many_patches_all_places_take_part() -> None:
    tokens = np.repeat(np.eye(6), [500, 20, 20, 20, 20, 500], axis=0)
    assert {tuple(part) for part in merged(tokens).tolist()} == {tuple(axis) for axis in np.eye(6).tolist()}
