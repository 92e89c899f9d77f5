"""The documentation names every command, setting and endpoint there is, and nothing that there is not."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.main import get_command

from clients.cli import app
from clients.datasets.folders import find_sequences, load_burst
from service.app import create_app
from service.console.pages import NAVIGATION
from service.errors import KINDS
from service.settings import Settings

ROOT = Path(__file__).parents[2]
PAGES = [*(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")), *sorted((ROOT / "docs").glob("*.md"))]
TEXT = "\n".join(page.read_text() for page in PAGES)
HTTP = (ROOT / "docs" / "http.md").read_text()
OPERATIONS = (ROOT / "docs" / "operations.md").read_text()
OTHER_SETTINGS = {"ONELOOK_API_KEY", "ONELOOK_CACHE", "ONELOOK_URL"}
"""Read outside the service."""


def commands(command: Any, name: str = "onelook") -> Iterator[str]:
    """Full names of a command's leaves."""
    inner = getattr(command, "commands", None)
    if inner is None:
        yield name
        return
    for child, below in inner.items():
        yield from commands(below, f"{name} {child}")


COMMANDS = sorted(commands(get_command(app)))
SETTINGS = {f"ONELOOK_{name.upper()}" for name in Settings.model_fields}
PATHS = create_app(Settings()).openapi()["paths"]
ENDPOINTS = sorted((method.upper(), path) for path, methods in PATHS.items() for method in methods)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_documented(command: str) -> None:
    assert re.search(rf"\b{command}\b", TEXT), f"no page says `{command}`"


def test_the_commands_are_found() -> None:
    assert {"onelook serve", "onelook bench pose"} <= set(COMMANDS)


def test_documented_commands_exist() -> None:
    known = {" ".join(command.split()[:words]) for command in COMMANDS for words in (2, 3)}
    shown = set(re.findall(r"(?:^|`)(onelook [a-z]+)(?: |`|$)", TEXT, re.MULTILINE))
    groups = "|".join({command.split()[1] for command in COMMANDS if len(command.split()) == 3})
    shown |= set(re.findall(rf"(?:^|`)(onelook (?:{groups}) [a-z-]+)", TEXT, re.MULTILINE))
    assert shown <= known


def test_every_setting_is_documented() -> None:
    assert set(re.findall(r"ONELOOK_[A-Z_]+", OPERATIONS)) == SETTINGS | OTHER_SETTINGS


def test_documented_settings_exist() -> None:
    assert set(re.findall(r"ONELOOK_[A-Z_]+", TEXT)) <= SETTINGS | OTHER_SETTINGS


def test_documented_defaults_are_the_defaults() -> None:
    defaults = re.findall(r"^\| `(ONELOOK_[A-Z_]+)` \| `([^`]+)` \|", OPERATIONS, re.MULTILINE)
    assert len(defaults) > 20
    for variable, default in defaults:
        assert str(Settings.model_fields[variable.removeprefix("ONELOOK_").lower()].default) == default, variable


@pytest.mark.parametrize(("method", "path"), ENDPOINTS)
def test_every_endpoint_is_documented_with_a_curl(method: str, path: str) -> None:
    assert f"`{method} {path}`" in HTTP
    address = r"\$URL" + re.sub(r"\\\{\w+\\\}", r"[$\\w]+", re.escape(path)) + r"(?![/\w])"
    calls = [line for line in HTTP.splitlines() if line.startswith("curl ") and re.search(address, line)]
    assert any(method_of(call) == method for call in calls), f"no curl calls {method} {path}"


def method_of(call: str) -> str:
    """What a curl line sends: what -X says, else POST with a body, else GET."""
    named = re.search(r"-X (\w+)", call)
    if named:
        return named[1]
    return "POST" if re.search(r" (-F|-d|--data-binary) ", call) or "/complete" in call else "GET"


@pytest.mark.parametrize(("status", "kind"), [*((status, kind) for _, status, kind, _ in KINDS), (500, "unexpected")])
def test_every_kind_of_error_is_documented(status: int, kind: str) -> None:
    (row,) = re.findall(rf"^\| {status} \|(.*)\|$", HTTP.partition("\n## Errors\n")[2], re.MULTILINE)
    assert f"`{kind}`" in row


@pytest.mark.parametrize(("method", "path"), ENDPOINTS)
def test_every_query_option_is_documented(method: str, path: str) -> None:
    options = [each["name"] for each in PATHS[path][method.lower()].get("parameters", []) if each["in"] == "query"]
    assert [each for each in options if not re.search(rf"`[^`]*\b{each}\b[^`]*`|[?&]{each}=", HTTP)] == []


def test_documented_endpoints_exist() -> None:
    for method, path in re.findall(r"`(GET|POST|PATCH|DELETE|PUT) (/[^`]*)`", TEXT):
        assert (method, path) in ENDPOINTS


@pytest.mark.parametrize("path", [link.path for link in NAVIGATION])
def test_every_page_of_the_console_is_documented(path: str) -> None:
    assert f"| `{path}` |" in (ROOT / "docs" / "console.md").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)]+)\)", page.read_text()):
        file, _, anchor = target.partition("#")
        linked = (page.parent / file).resolve() if file else page
        assert linked.exists(), f"{page.name} links to {target}"
        if anchor:
            headings = re.findall(r"^#+ (.+)$", linked.read_text(), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}, target


def test_every_named_test_exists() -> None:
    named = set(re.findall(r"`(tests/[\w/]+\.py)`", TEXT))
    assert named
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []


@pytest.mark.parametrize(("page", "heading"), [("operations.md", "What it survives"), ("security.md", "Threats")])
def test_every_promise_names_its_test(page: str, heading: str) -> None:
    section = (ROOT / "docs" / page).read_text().partition(f"## {heading}\n")[2].partition("\n## ")[0]
    promises = [line for line in section.splitlines() if line.startswith("| ")][1:]
    assert len(promises) > 5
    assert [line for line in promises if not re.search(r"`tests/[\w/]+\.py`[^|]*\|$", line)] == []


def test_the_example_burst_is_of_the_recording_it_is_shown_with(samples: Path) -> None:
    example = json.loads((ROOT / "docs" / "burst.json").read_text())
    recording = samples / "cup" / "cup_1"
    burst = load_burst(find_sequences(recording)[0], range(len(example["views"])))
    for shown, camera in zip(example["views"], burst.cameras, strict=True):
        np.testing.assert_allclose(shown["K"], camera.K, rtol=1e-4)
        np.testing.assert_allclose(shown["world_from_camera"], camera.world_from_camera, atol=1e-5)
    scales = {camera["depth_scale"] for camera in json.loads((recording / "scene_camera.json").read_text()).values()}
    assert [1000 * example["depth_scale"]] == pytest.approx(list(scales))
