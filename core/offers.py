"""What the files of a folder offer, by name: adding a file there is all that adding a backbone, an estimator, a score or a data set takes.

A file offers what its `OFFERS` says; a file without `OFFERS` is what the others share.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

T = TypeVar("T")


class Offers(Mapping[str, T]):
    """Everything that a package's files offer, sorted by name; they are imported when it is first asked, so naming it costs nothing."""

    def __init__(self, package: str) -> None:
        self._package = package

    def __getitem__(self, name: str) -> T:
        return self._offered[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._offered)

    def __len__(self) -> int:
        return len(self._offered)

    @cached_property
    def _offered(self) -> dict[str, T]:
        found: dict[str, T] = {}
        for file in iter_modules(import_module(self._package).__path__, f"{self._package}."):
            more: Mapping[str, T] = getattr(import_module(file.name), "OFFERS", {})
            twice = sorted(found.keys() & more.keys())
            if twice:
                raise ValueError(f"{file.name} offers {', '.join(twice)}, which a file beside it does already; choose another name")
            found |= more
        return dict(sorted(found.items()))
