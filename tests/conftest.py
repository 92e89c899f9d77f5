"""What every test may rely on: an environment without the user's settings, and examples that are the same on every run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")


@pytest.fixture(autouse=True)
def no_user_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hides the user's ONELOOK_* settings; ONELOOK_CACHE stays, since the weights are in it."""
    for name in os.environ:
        if name.startswith("ONELOOK_") and name != "ONELOOK_CACHE":
            monkeypatch.delenv(name)


@pytest.fixture(scope="session")
def samples() -> Path:
    """The repository's recordings: real images, in the data layout."""
    return Path(__file__).parent / "data" / "bursts"
