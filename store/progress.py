"""Telling how far work is, to whoever wants to know."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""Told how much of how much is done; bytes unless it says otherwise."""


def untold(done: int, total: int) -> None:
    """Where nobody wants to know."""
