"""Keys and sessions: what is kept of them, who is found by them, and when that ends."""

from __future__ import annotations

import sqlite3
import threading
from datetime import timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import Conflict, InvalidInput, NotFound, Unavailable
from store.keys import Key, Keys
from store.memory import Memory

TURNS = 10
"""Without waiting, the first few fail already."""


def test_a_key_is_found_by_its_text(memory: Memory) -> None:
    key, text = memory.keys.create("arm", "robot")
    assert memory.keys.find(text) == key
    assert (key.name, key.role, key.revoked_at) == ("arm", "robot", None)


def test_every_key_has_a_secret_of_its_own(memory: Memory) -> None:
    texts = {memory.keys.create(f"arm-{index}", "robot")[1] for index in range(3)}
    assert len({text.split("_", 2)[2] for text in texts}) == 3


@pytest.mark.parametrize("change", ["secret", "last letter", "id", "prefix", "empty", "unicode", "no secret"])
def test_what_is_not_the_key_finds_nobody(memory: Memory, change: str) -> None:
    text = memory.keys.create("arm", "robot")[1]
    other = memory.keys.create("other", "admin")[1]
    prefix, key_id, secret = text.split("_", 2)
    wrong = {
        "secret": f"{prefix}_{key_id}_{other.split('_', 2)[2]}",
        "last letter": text[:-1] + ("A" if text[-1] != "A" else "B"),
        "id": f"{prefix}_000000000000_{secret}",
        "prefix": f"other_{key_id}_{secret}",
        "empty": "",
        "unicode": f"{prefix}_{key_id}_\ud800é",
        "no secret": f"{prefix}_{key_id}_",
    }[change]
    assert memory.keys.find(wrong) is None


def test_the_file_gives_no_key_away(memory: Memory, folder: Path) -> None:
    text = memory.keys.create("arm", "robot")[1]
    secret = text.split("_", 2)[2]
    session = memory.sessions.begin(memory.keys.all()[0], timedelta(hours=1))
    memory.close()
    with sqlite3.connect(folder / "memory.sqlite3") as db:
        dump = "\n".join(db.iterdump())
    db.close()
    assert "arm" in dump
    assert secret not in dump
    assert session not in dump


def test_a_revoked_key_finds_nobody_and_the_door_stays_locked(memory: Memory) -> None:
    assert not memory.keys.required()
    key, text = memory.keys.create("arm", "robot")
    revoked = memory.keys.revoke(key.id)
    assert (revoked.id, revoked.name, revoked.role, revoked.created_at) == (key.id, key.name, key.role, key.created_at)
    assert revoked.revoked_at is not None
    assert memory.keys.find(text) is None
    assert memory.keys.all() == []
    assert memory.keys.required()
    with pytest.raises(NotFound, match="onelook keys list"):
        memory.keys.revoke(key.id)


def test_names_are_one_line_and_tell_keys_apart(memory: Memory) -> None:
    key, _ = memory.keys.create("arm", "robot")
    with pytest.raises(Conflict, match="'arm'"):
        memory.keys.create("arm", "admin")
    memory.keys.revoke(key.id)
    memory.keys.create("arm", "admin")
    for name in ("", "  ", "two\nlines", "x" * 101):
        with pytest.raises(InvalidInput, match="^name: is .*; give 1 to 100 printable characters that say who has the key$"):
            memory.keys.create(name, "robot")


def test_a_role_that_there_is_not_is_refused(memory: Memory) -> None:
    with pytest.raises(InvalidInput, match="^role: is 'boss'; the roles are viewer, robot, admin$"):
        memory.keys.create("arm", "boss")


def test_the_audit_trail_tells_of_both_ends(memory: Memory) -> None:
    key, text = memory.keys.create("arm", "robot", actor="onelook keys")
    memory.keys.revoke(key.id, actor="onelook keys")
    end, beginning = memory.audit.latest(2)
    about = {"key": key.id, "name": "arm", "role": "robot"}
    assert (beginning.action, beginning.before, beginning.after, beginning.actor) == ("key", {}, about, "onelook keys")
    assert (end.action, end.before, end.after, end.actor) == ("revoke", about, {}, "onelook keys")
    assert not end.undoable
    assert text.split("_", 2)[2] not in str(beginning.after)


def test_keys_are_made_and_revoked_beside_the_process_that_has_the_memory_open(memory: Memory, folder: Path) -> None:
    with Memory.keyring(folder) as keys:
        key, text = keys.create("arm", "robot")
    assert memory.keys.find(text) == key
    with Memory.keyring(folder) as keys:
        keys.revoke(key.id)
    assert memory.keys.find(text) is None


def test_the_first_key_may_come_before_the_memory(tmp_path: Path) -> None:
    with Memory.keyring(tmp_path / "new") as keys:
        _, text = keys.create("arm", "robot")
    with Memory.open(tmp_path / "new") as memory:
        assert memory.keys.find(text) is not None


@pytest.fixture
def key(memory: Memory) -> Key:
    """An admin's."""
    return memory.keys.create("anna", "admin")[0]


def test_a_session_is_found_until_it_ends(memory: Memory, key: Key) -> None:
    token = memory.sessions.begin(key, timedelta(hours=1))
    assert memory.sessions.find(token) == key
    assert memory.sessions.find(token + "x") is None
    memory.sessions.end(token)
    assert memory.sessions.find(token) is None


def test_a_session_expires(memory: Memory, key: Key) -> None:
    lasting = memory.sessions.begin(key, timedelta(hours=1))
    over = memory.sessions.begin(key, timedelta(hours=-1))
    assert memory.sessions.find(over) is None
    memory.prune()
    assert [row["n"] for row in memory._connection.rows("SELECT count(*) AS n FROM sessions")] == [1]
    assert memory.sessions.find(lasting) == key


def test_a_session_is_over_with_its_key(memory: Memory, key: Key) -> None:
    token = memory.sessions.begin(key, timedelta(hours=1))
    memory.keys.revoke(key.id)
    assert memory.sessions.find(token) is None


def test_two_processes_that_change_keys_wait_for_each_other(memory: Memory, folder: Path) -> None:
    """Both read before they write: SQLite refuses such a transaction where another one was committed in between."""
    failed: list[Exception] = []

    def work(keys: Keys, prefix: str) -> None:
        try:
            for index in range(TURNS):
                key, _ = keys.create(f"{prefix} {index}", "robot")
                keys.revoke(key.id)
        except Unavailable as error:
            failed.append(error)

    with Memory.keyring(folder) as beside:
        threads = [threading.Thread(target=work, args=each) for each in ((memory.keys, "service"), (beside, "command"))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert failed == []
    assert memory.keys.all() == []


def test_no_text_is_a_key_by_chance(memory: Memory) -> None:
    key, _ = memory.keys.create("arm", "robot")

    @given(st.text())
    def whatever(text: str) -> None:
        assert all(memory.keys.find(each) is None for each in (text, f"onelook_{text}", f"onelook_{key.id}_{text}"))
        assert memory.sessions.find(text) is None

    whatever()
