"""Folders exist whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from store.folders import new_folder, remove_orphans


def test_a_folder_gets_its_name_when_it_is_whole(tmp_path: Path) -> None:
    final = tmp_path / "things" / "a"
    with new_folder(final) as partial:
        (partial / "file").write_text("content")
        assert not final.exists()
    assert (final / "file").read_text() == "content"
    assert not partial.exists()


def test_an_error_leaves_nothing_behind(tmp_path: Path) -> None:
    def write() -> None:
        with new_folder(tmp_path / "a") as partial:
            (partial / "file").write_text("half")
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        write()
    assert list(tmp_path.iterdir()) == []


def test_orphans_are_removed_and_named(tmp_path: Path) -> None:
    for name in ("kept", "orphan", ".partial-b"):
        (tmp_path / name).mkdir()
    assert remove_orphans(tmp_path, {"kept"}) == [".partial-b", "orphan"]
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
