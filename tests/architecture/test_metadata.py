"""What the files for people who cite and upgrade say is what the distribution says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
PROJECT = (ROOT / "pyproject.toml").read_text()


def stated(name: str) -> str:
    """A text of pyproject.toml."""
    (value,) = re.findall(rf'^{name} = "(.*)"$', PROJECT, re.MULTILINE)
    return value


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    return dict(yaml.safe_load((ROOT / "CITATION.cff").read_text()))


def test_the_citation_is_of_this_version(citation: dict[str, Any]) -> None:
    assert (citation["version"], citation["license"]) == (stated("version"), stated("license"))


def test_the_citation_has_what_its_format_asks_for(citation: dict[str, Any]) -> None:
    assert citation["cff-version"] == "1.2.0"
    for work in (citation, *citation["references"]):
        assert {"authors", "title", "type"} <= set(work)
        assert all(set(author) in ({"name"}, {"family-names", "given-names"}) for author in work["authors"])
    assert isinstance(citation["message"], str)


def test_the_changelog_tells_of_this_version() -> None:
    assert re.search(rf"\b{re.escape(stated('version'))}\b", (ROOT / "CHANGELOG.md").read_text())
