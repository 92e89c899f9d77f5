"""Errors go from process to process as they are."""

from __future__ import annotations

import pickle

import pytest

from core.errors import InvalidInput, NoObject, OneLookError, TooFewViews, Unavailable


@pytest.mark.parametrize(
    "error", [InvalidInput("views[3].depth", "is zero"), TooFewViews("views", "found 1"), NoObject("views", "none"), Unavailable("busy")]
)
def test_an_error_is_the_same_in_another_process(error: OneLookError) -> None:
    there = pickle.loads(pickle.dumps(error))
    assert type(there) is type(error)
    assert str(there) == str(error)
    assert vars(there) == vars(error)
