"""Every command line in the documents is one that `onelook` and `make` take."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from clients.cli import app

ROOT = Path(__file__).parents[2]
TEXT = "\n".join(page.read_text() for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))])
BLOCK = re.compile(r"^ *```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
INDENTED = re.findall(r"^ {4}(.*)", BLOCK.sub("", TEXT), re.MULTILINE)
TYPED = "\n".join([*INDENTED, *(block.replace("\\\n", " ") for language, block in BLOCK.findall(TEXT) if language in ("", "sh"))])
WITHIN = "\n".join(" ".join(each.split()) for each in re.findall(r"`([^`]+)`", BLOCK.sub("", TEXT)))
"""Between backticks in a sentence."""
COMMANDS = re.sub(r"\$\([^)]*\)", "X", re.sub(r" +[#>] .*", "", f"{TYPED}\n{WITHIN}"))
"""Without comments, redirections and what a shell puts in."""
LINES = sorted(set(re.findall(r"(?:^|[ /])onelook ((?:[a-z][a-z-]* )+(?!--help)[^a-z\s].*|\w+ \w+[/:.].*)", COMMANDS, re.MULTILINE)))
"""With an argument or an option: bare names are looked at by test_docs.py."""
TARGETS = sorted(set(re.findall(r"\bmake ([a-z]+)", COMMANDS)))


COMMAND = get_command(app)


def take(command: Any, words: list[str]) -> None:
    """Reads a command line as the program would, and does nothing. Raises what the program would print."""
    with command.make_context("onelook", words) as context:
        if hasattr(command, "resolve_command"):
            _, inner, rest = command.resolve_command(context, [*context._protected_args, *context.args])
            take(inner, rest)


@pytest.mark.parametrize("line", LINES)
def test_the_command_takes_a_documented_line(line: str) -> None:
    take(COMMAND, shlex.split(line))


def test_an_option_that_there_is_not_is_refused() -> None:
    with pytest.raises(Exception, match="--vews"):
        take(COMMAND, ["bench", "pose", "--data", "DIR", "--vews", "10"])


def test_lines_are_found_in_blocks_and_in_sentences() -> None:
    assert len(LINES) > 60
    assert {"scan tests/data/bursts/microwave/microwave_0 --name microwave", "observe FOLDER --format bop"} <= set(LINES)


@pytest.mark.parametrize("target", TARGETS)
def test_the_makefile_has_a_documented_target(target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
