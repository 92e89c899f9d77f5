"""Backup and restore, typed as docs/operations.md has them, in folders of their own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from store.memory import Memory

ROOT = Path(__file__).parents[2]
OPERATIONS = (ROOT / "docs" / "operations.md").read_text()
STATE = "/var/lib/onelook"


def typed(heading: str) -> str:
    """The commands of a procedure, one after the other."""
    section = OPERATIONS.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    return "\n".join(re.sub(r"^ {3}", "", block, flags=re.MULTILINE) for block in re.findall(r"```sh\n(.*?)```", section, re.DOTALL))


class Machine:
    """A machine's folder for what the service keeps; what is asked of systemd is noted."""

    def __init__(self, folder: Path) -> None:
        self.state = folder / "state"
        self.state.mkdir(parents=True)
        self.memory = self.state / "memory"
        self._tools = folder / "tools"
        self._tools.mkdir()
        self._asked = folder / "asked"
        self._asked.touch()
        self._tool("systemctl", f'echo "$*" >> {self._asked}')
        self._tool("onelook", f'exec {sys.executable} -m clients.cli "$@"')

    def _tool(self, name: str, script: str) -> None:
        (self._tools / name).write_text(f"#!/bin/sh\n{script}\n")
        (self._tools / name).chmod(0o755)

    @property
    def asked(self) -> list[str]:
        """Of systemd."""
        return self._asked.read_text().splitlines()

    def type(self, heading: str) -> str:
        """Types a procedure; what it printed."""
        environment = os.environ | {
            "PATH": f"{self._tools}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "ONELOOK_DATA_DIR": str(self.memory),
        }
        script = typed(heading).replace(STATE, str(self.state))
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


@pytest.fixture
def first(tmp_path: Path) -> Machine:
    """A machine whose service knows a cup, and a key."""
    machine = Machine(tmp_path / "first")
    shutil.unpack_archive(ROOT / "tests" / "data" / "memory_m001.zip", machine.memory)
    with Memory.open(machine.memory) as memory:
        memory.keys.create("anna", "admin")
    return machine


@pytest.mark.parametrize("empty", [True, False])
def test_a_memory_moves_to_another_machine(first: Machine, tmp_path: Path, empty: bool) -> None:
    assert first.type("Back up").count("everything is what was written") == 2
    (archive,) = first.state.glob("*.tar")
    other = Machine(tmp_path / "other")
    if not empty:  # a service has run there
        with Memory.open(other.memory):
            pass
    shutil.copy(archive, other.state)
    assert "everything is what was written" in other.type("Restore on another machine")
    assert other.asked == ["stop onelook", "start onelook"]
    with Memory.open(other.memory) as memory:
        assert [category.name for category in memory.categories.all()] == ["cup"]
        assert [key.name for key in memory.keys.all()] == ["anna"]
        assert memory.check().ok
    assert (other.state / "memory.before").exists() is not empty


def test_going_back_puts_the_copy_of_before_in_its_place(tmp_path: Path) -> None:
    machine = Machine(tmp_path / "one")
    shutil.unpack_archive(ROOT / "tests" / "data" / "memory_m001.zip", machine.memory)
    old = (machine.memory / "memory.sqlite3").stat().st_size
    with Memory.open(machine.memory):
        pass
    (copy,) = machine.memory.glob("*.before-*")
    back = [block for block in re.findall(r"```sh\n(.*?)```", OPERATIONS, re.DOTALL) if "before-STEP" in block]
    assert len(back) == 1
    step = copy.name.partition(".before-")[2]
    script = back[0].replace(STATE, str(machine.state)).replace("STEP", step)
    subprocess.run(["bash", "-euo", "pipefail", "-c", script], check=True)
    assert (machine.memory / "memory.sqlite3").stat().st_size == old
    with Memory.open(machine.memory) as memory:
        assert [category.name for category in memory.categories.all()] == ["cup"]


def test_procedures_install_what_make_and_the_image_install() -> None:
    install = typed("Install")
    (libraries,) = re.findall(r"^LIBRARIES := (.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert libraries in install
    assert "docker/systemd/onelook.service" in install
    for procedure in (install, typed("Upgrade")):
        torch, rest = (line.partition(" install ")[2] for line in procedure.splitlines() if "pip install" in line)
        assert re.fullmatch(r"--constraint constraints\.txt --no-deps --index-url \S+ torch", torch)
        assert rest == "--constraint constraints.txt '.[server]'"
