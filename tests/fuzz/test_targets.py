"""A short, repeatable part of the fuzzing: the seeds as they are, and changed in ways that break formats; `make fuzz` goes on longer."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.fuzz.targets import CORPUS, TARGETS, attempt, seeds

pytestmark = [
    pytest.mark.filterwarnings("ignore::UserWarning:PIL"),  # of EXIF that is cut
    pytest.mark.filterwarnings("ignore:.*SpooledTemporaryFile:pytest.PytestUnraisableExceptionWarning"),  # Starlette leaves it to Python
]
TRIES = 60
"""Of each seed."""
TELLING = [
    b"\0",
    b"\xff",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"[",
    b"{",
    b'"',
    b"-1",
    b"1e999",
    b"\\ud800",
    b"PK\3\4",
    b"\r\n\r\n",
    b"--xx",
]
"""Bytes at which parsers go wrong."""


def changed(content: bytes, chance: random.Random) -> bytes:
    """A few bytes flipped, cut, doubled, or replaced by telling ones."""
    found = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        where = chance.randrange(len(found) + 1)
        kind = chance.randrange(6)
        if kind == 0 and found:
            found[where % len(found)] ^= 1 << chance.randrange(8)
        elif kind == 1:
            del found[where:]
        elif kind == 2:
            del found[where : where + chance.randint(1, 16)]
        elif kind == 3:
            found[where:where] = found[where : where + chance.randint(1, 200)] * chance.randint(1, 5)
        elif kind == 4:
            found[where:where] = chance.choice(TELLING)
        else:
            telling = chance.choice(TELLING)
            found[where : where + len(telling)] = telling
    return bytes(found)


@pytest.mark.parametrize("name", TARGETS)
def test_every_target_takes_its_seeds(name: str) -> None:
    assert seeds(name)
    assert all(attempt(name, seed) for seed in seeds(name))


@pytest.mark.parametrize("found", sorted((CORPUS / "findings").iterdir()), ids=lambda found: found.name)
def test_what_once_broke_a_target_is_refused(found: Path) -> None:
    assert not attempt(found.name.partition("-")[0], found.read_bytes())


@pytest.mark.parametrize("name", TARGETS)
def test_what_is_broken_is_refused_and_nothing_else_happens(name: str) -> None:
    chance = random.Random(name)
    taken = [attempt(name, changed(seed, chance)) for seed in [*seeds(name), b""] for _ in range(TRIES)]
    assert not all(taken)
