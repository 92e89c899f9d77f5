"""What somebody else wrote is refused before more of it is believed than was seen."""

from __future__ import annotations

import io
import zipfile

import cv2
import numpy as np
import pytest

from core.errors import InvalidInput
from store import untrusted


def zipped(*entries: tuple[str, bytes], method: int = zipfile.ZIP_STORED) -> zipfile.ZipFile:
    """An archive of these, open."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in entries:
            archive.writestr(name, content)
    return zipfile.ZipFile(buffer)


def test_plain_entries_come_with_their_names() -> None:
    archive = zipped(("a", b"one"), ("b", b"two"))
    found = untrusted.entries(archive, limit=100)
    assert {name: untrusted.content(archive, info) for name, info in found.items()} == {"a": b"one", "b": b"two"}


def test_more_entries_than_are_read_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(untrusted, "MAX_ENTRIES", 1)
    with pytest.raises(InvalidInput, match="has 2 entries, at most 1"):
        untrusted.entries(zipped(("a", b""), ("b", b"")), limit=100)


def test_a_name_that_two_entries_have_is_refused() -> None:
    with pytest.warns(UserWarning, match="Duplicate name"):
        archive = zipped(("a", b"one"), ("a", b"two"))
    with pytest.raises(InvalidInput, match="several entries of the same name"):
        untrusted.entries(archive, limit=100)


def test_an_entry_of_more_bytes_than_are_read_is_refused() -> None:
    archive = zipped(("a", b"four"))
    with pytest.raises(InvalidInput, match="'a' has 4 bytes, at most 3"):
        untrusted.content(archive, archive.getinfo("a"), limit=3)


def test_an_entry_of_fewer_bytes_than_it_says_is_refused() -> None:
    archive = zipped(("a", b"four"), method=zipfile.ZIP_DEFLATED)
    info = archive.getinfo("a")
    info.file_size += 1
    with pytest.raises(InvalidInput, match="'a' has not the 5 bytes"):
        untrusted.content(archive, info)


def test_an_entry_that_is_not_what_was_packed_is_refused() -> None:
    archive = zipped(("a", b"four"))
    info = archive.getinfo("a")
    info.CRC ^= 1
    with pytest.raises(InvalidInput, match="'a' cannot be read .*copy the archive again"):
        untrusted.content(archive, info)


def test_a_picture_that_begins_as_one_and_goes_on_as_another_thing_is_refused() -> None:
    written = cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1].tobytes()
    untrusted.require_picture(written, "a.png")
    with pytest.raises(InvalidInput, match=r"'a\.png' cannot be decoded"):
        untrusted.require_picture(written[:24] + bytes(40), "a.png")
