"""Correspondences of hand-made descriptors."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from core.correspond import PatchSet, match

EYE = np.eye(4, dtype=np.float32)
LINE = np.array([[0, 0], [0, 1], [0, 5], [0, 9]], dtype=np.float32)


def patches(*views: np.ndarray) -> PatchSet:
    return PatchSet.of(views, [LINE[: len(view)] for view in views])


@pytest.mark.parametrize("method", ["nearest", "mutual", "cyclical"])
def test_a_permutation_is_found(method: str) -> None:
    order = [2, 0, 3, 1]
    found = match(patches(EYE), patches(EYE[order]), 4, method)
    pairs = dict(zip(found.reference_patch[0, 0].tolist(), found.target_patch[0, 0].tolist()))
    assert pairs == {reference: order.index(reference) for reference in range(4)}
    assert np.isclose(found.view_similarity()[0, 0], 4)


def two_alike() -> tuple[PatchSet, PatchSet]:
    """Reference patches 0 and 1 both resemble target patch 0; 0 more so."""
    reference = np.array([[1, 0, 0, 0], [0.9, 0.4359, 0, 0], [0, 0, 1, 0]], dtype=np.float32)
    target = np.array([[1, 0, 0, 0], [0, 0, 1, 0]], dtype=np.float32)
    return patches(reference), patches(target)


def test_mutual_drops_what_cyclical_ranks_last() -> None:
    reference, target = two_alike()
    mutual = match(reference, target, 3, "mutual")
    assert mutual.valid[0, 0].sum() == 2
    cyclical = match(reference, target, 3, "cyclical")
    assert cyclical.valid[0, 0].all()
    assert cyclical.reference_patch[0, 0].tolist()[-1] == 1


def test_the_longer_cycle_ranks_after_the_shorter() -> None:
    """Patches 1 and 2 both return to patch 0, one cell and five cells away; 2 is the more similar."""
    reference = np.array([[1, 0, 0], [0.8, 0.6, 0], [0.9, 0, 0.4359]], dtype=np.float32)
    target = np.array([[1, 0, 0]], dtype=np.float32)
    assert match(patches(reference), patches(target), 3).reference_patch[0, 0].tolist() == [0, 1, 2]
    assert match(patches(reference), patches(target), 3, "nearest").reference_patch[0, 0].tolist() == [0, 2, 1]


def test_distance_in_metres_ranks_where_metres_are_given() -> None:
    """Patches 1 and 2 return to patch 0 as above; by their points 2 is the nearer."""
    reference = np.array([[1, 0, 0], [0.9, 0, 0.4359], [0.8, 0.6, 0]], dtype=np.float32)
    points = np.array([[0, 0, 0], [0, 0, 0.05], [0, 0, 0.01]], dtype=np.float32)
    target = patches(np.array([[1, 0, 0]], dtype=np.float32))
    found = match(PatchSet.of([reference], [points]), target, 3, "cyclical-3d")
    assert found.reference_patch[0, 0].tolist() == [0, 2, 1]


def test_equal_cycles_are_ranked_by_similarity() -> None:
    reference, target = np.eye(3, dtype=np.float32), np.diag([0.7, 0.9, 0.8]).astype(np.float32)
    found = match(patches(reference), patches(target), 3, "cyclical")
    assert found.reference_patch[0, 0].tolist() == [1, 2, 0]
    assert found.similarity[0, 0].tolist() == pytest.approx([0.9, 0.8, 0.7])


@pytest.mark.parametrize(("asked", "got"), [(2, 2), (9, 4)])
def test_as_many_as_asked_for_and_there_are(asked: int, got: int) -> None:
    assert match(patches(EYE), patches(EYE), asked).valid.shape == (1, 1, got)


def test_only_the_pairs_asked_for_are_matched() -> None:
    found = match(patches(EYE, EYE), patches(EYE, EYE, EYE), 4, pairs=[(1, 2), (0, 0)])
    assert found.valid.all(dim=-1).tolist() == [[True, False, False], [False, False, True]]
    assert found.view_similarity().tolist() == [[4, 0, 0], [0, 0, 4]]


def test_padding_is_never_matched() -> None:
    found = match(patches(EYE, EYE[:1]), patches(EYE[:2], EYE), 4)
    assert found.valid[1, 0].sum() == 1
    assert found.valid[0, 0].sum() == 4
    assert found.target_patch[0, 0].max() < 2


def test_a_view_without_patches_matches_nothing() -> None:
    found = match(patches(EYE), patches(EYE[:0], EYE), 4)
    assert not found.valid[0, 0].any()
    assert found.view_similarity()[0, 0] == 0
    assert found.valid[0, 1].all()


def test_views_of_which_none_has_patches_match_nothing() -> None:
    assert match(patches(EYE[:0]), patches(EYE[:0]), 4).valid.tolist() == [[[False]]]


def test_similarities_take_no_more_memory_than_descriptors() -> None:
    assert match(patches(EYE), patches(EYE), 4).similarity.dtype == torch.float32
