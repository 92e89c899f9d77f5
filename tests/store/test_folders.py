"""Folders exist whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from store.folders import FileSum, new_folder, problem, remove_orphans


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


def test_orphans_are_removed(tmp_path: Path) -> None:
    for name in ("kept", "orphan", ".partial-b"):
        (tmp_path / name).mkdir()
    (tmp_path / "kept" / "file").write_text("content")
    (tmp_path / "stray").write_text("left")
    (tmp_path / "link").symlink_to(tmp_path / "kept")
    remove_orphans(tmp_path, {"kept"})
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
    assert (tmp_path / "kept" / "file").exists()


def test_a_file_that_is_what_was_written_has_no_problem(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    assert problem(tmp_path / "file", FileSum.of(b"content")) is None


def test_what_cannot_be_read_has_the_machine_s_problem(tmp_path: Path) -> None:
    assert problem(tmp_path, FileSum.of(b"content")) == "cannot be read: Is a directory"
