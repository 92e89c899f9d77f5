"""Styles and scripts are this service's own, unchanged, and kept by browsers until they change."""

from __future__ import annotations

import hashlib
import re
from collections import Counter

import pytest

from service.console.assets import FOLDER, asset_url

VENDOR = FOLDER / "vendor"
SHEETS = [(FOLDER / f"{name}.css").read_text() for name in ("base", "pictures", "pages")]
"""In the order in which pages link them."""
LISTED = re.findall(r"^\| `([^`]+)` .*`([0-9a-f]{64})` \|$", (VENDOR / "README.md").read_text(), re.MULTILINE)


def test_every_library_is_listed() -> None:
    assert {name for name, _ in LISTED} == {path.name for path in VENDOR.glob("*.js")}


@pytest.mark.parametrize(("name", "sha256"), LISTED)
def test_libraries_are_what_was_published(name, sha256):
    assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() == sha256


def test_a_file_named_by_its_content_is_kept_for_good(client):
    answer = client.get(asset_url("base.css"))
    assert answer.headers["content-type"].startswith("text/css")
    assert "immutable" in answer.headers["cache-control"]


def test_a_module_that_another_imports_is_asked_for_again_but_not_sent_again(client):
    first = client.get("/static/vendor/three.module.min.js")
    assert first.headers["content-type"].startswith("text/javascript")
    assert first.headers["cache-control"] == "no-cache"
    again = client.get("/static/vendor/three.module.min.js", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_nothing_outside_the_folder_is_served(client):
    for path in ("../pages.py", "%2e%2e/pages.py", "vendor/../../pages.py"):
        assert client.get(f"/static/{path}").status_code == 404


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.*")), ids=lambda path: path.name)
def test_own_files_ask_for_nothing_from_elsewhere(path):
    addresses = set(re.findall(r"https?://[^\s\"')]+", path.read_text()))
    assert addresses <= {"http://www.w3.org/2000/svg"}


def declarations(sheet: str) -> list[tuple[str, str]]:
    """(selector, property) of every rule that holds for all screens."""
    plain = re.sub(r"/\*.*?\*/|@[^{;]*\{(?:[^{}]*\{[^{}]*\})*[^{}]*\}", "", sheet, flags=re.DOTALL)
    return [
        (selector.strip(), line.partition(":")[0].strip())
        for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", plain)
        for selector in re.split(r",(?![^(]*\))", selectors)
        for line in body.split(";")
        if line.strip()
    ]


def test_no_rule_of_a_class_is_undone_by_a_later_one():
    found = Counter(each for sheet in SHEETS for each in declarations(sheet) if each[0].startswith("."))
    assert len(found) > 500
    assert [each for each, times in found.items() if times > 1] == []


def test_every_class_that_is_styled_is_on_a_page():
    sources = [path for path in FOLDER.parent.rglob("*.*") if path.suffix in (".html", ".js", ".py") and VENDOR not in path.parents]
    text = "\n".join(path.read_text() for path in sources)
    styled = {name for sheet in SHEETS for selector, _ in declarations(sheet) for name in re.findall(r"\.([a-z][\w-]*)", selector)}
    assert [name for name in sorted(styled) if not re.search(rf"(?<![\w-]){re.sub(r'[0-9]+$', '', name)}", text)] == []


def test_every_file_is_installed():
    """setuptools takes along what pyproject.toml's package-data names."""
    console = FOLDER.parent
    others = [path.relative_to(console) for path in console.rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc")]
    strange = [path for path in others if path.parts[0] != "static" and path.suffix != ".html"]
    assert others
    assert not strange, "pyproject.toml's package-data names static/** and *.html"
