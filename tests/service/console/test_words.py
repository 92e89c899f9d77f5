"""Figures are written for people."""

from __future__ import annotations

import pytest

from service.console.words import percent


@pytest.mark.parametrize(
    ("share", "written"), [(0, "0 %"), (0.003, "< 1 %"), (0.874, "87 %"), (0.994, "99 %"), (0.9996, "> 99 %"), (1, "100 %")]
)
def test_nearly_sure_is_not_written_as_sure(share: float, written: str) -> None:
    assert percent(share) == written
