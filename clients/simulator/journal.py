"""What a run writes down as it goes, so that an interrupted one goes on: its settings in the first line, then a JSON line an item."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from clients.errors import ClientError

T = TypeVar("T")


def kept(
    items: Iterable[T], file: Path, settings: Mapping[str, object], as_line: Callable[[T], str], done: Sequence[T] = ()
) -> Iterator[T]:
    """The same items, each written down before the next one begins; those `done` by an interrupted run are written first."""
    with file.open("w", encoding="utf-8") as stream:
        stream.writelines(f"{line}\n" for line in (json.dumps(settings), *map(as_line, done)))
        stream.flush()
        for item in items:
            stream.write(f"{as_line(item)}\n")
            stream.flush()
            yield item


def interrupted(file: Path, settings: Mapping[str, object]) -> list[str]:
    """The whole lines of items that an interrupted run left in a file.

    Raises ClientError where there was none, or it was of other settings.
    """
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    if not lines:
        raise ClientError(f"there is no run to resume in {file.parent}; leave out --resume")
    written, *rest = lines
    if json.loads(written) != json.loads(json.dumps(settings)):
        raise ClientError(f"the run in {file.parent} was of {written}; resume it with the same settings, or name another --out")
    return [line for line in rest if line.endswith("}")]
