"""A folder's files are found by what they offer."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from core.offers import Offers

Make = Callable[..., Offers[int]]
NUMBERS = itertools.count()


@pytest.fixture
def offers_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """offers_of(file="text", …): of a package of these files, called differently each time, since modules stay imported."""

    def make(**files: str) -> Offers[int]:
        name = f"offering{next(NUMBERS)}"
        (tmp_path / name).mkdir()
        for file, text in {"__init__": "", **files}.items():
            (tmp_path / name / f"{file}.py").write_text(text)
        monkeypatch.syspath_prepend(tmp_path)
        return Offers(name)

    return make


def test_what_files_offer_is_found_by_name_and_the_rest_is_left_alone(offers_of: Make) -> None:
    offers = offers_of(large='OFFERS = {"ten": 10, "hundred": 100}', base="OTHER = {'none': 0}", small='OFFERS = {"one": 1}')
    assert dict(offers) == {"hundred": 100, "one": 1, "ten": 10}
    assert list(offers) == ["hundred", "one", "ten"]
    assert (offers["ten"], "none" in offers, len(offers)) == (10, False, 3)


def test_nothing_is_imported_before_it_is_asked(offers_of: Make) -> None:
    offers = offers_of(heavy='OFFERS = {"one": 1}')
    package = vars(offers)["_package"]
    assert package not in sys.modules
    assert "one" in offers
    assert f"{package}.heavy" in sys.modules


def test_folders_of_files_are_not_asked(offers_of: Make, tmp_path: Path) -> None:
    offers = offers_of(one='OFFERS = {"one": 1}')
    inner = tmp_path / vars(offers)["_package"] / "figures"
    inner.mkdir()
    (inner / "two.py").write_text('OFFERS = {"two": 2}')
    assert list(offers) == ["one"]


def test_a_name_that_two_files_offer_is_an_error_that_says_which(offers_of: Make) -> None:
    with pytest.raises(ValueError, match=r"\.b offers ten, which a file beside it does already"):
        len(offers_of(a='OFFERS = {"ten": 10}', b='OFFERS = {"one": 1, "ten": 11}'))
