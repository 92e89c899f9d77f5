"""`make` installs for each target what it needs, and says what the system lacks before pip takes minutes. Its programs are stubs here."""

from __future__ import annotations

import os
import pty
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MAKEFILE = (ROOT / "Makefile").read_text()
PYTHON = """#!/bin/sh
echo "$*" >> {calls}
case "$*" in
*{lacks}*) exit 1 ;;
*"-m venv"*) mkdir -p {venv}/bin && cp "$0" {venv}/bin/python ;;
*--editable*) cp {accepts} {venv}/bin/onelook ;;
esac
"""
"""A python that lacks something; its pip installs a command that does nothing."""


def stated(name: str) -> str:
    """A variable of the Makefile."""
    (value,) = re.findall(rf"^{name} := (.*)$", MAKEFILE, re.MULTILINE)
    return value


@dataclass
class Machine:
    """A folder with the programs that make finds."""

    folder: Path
    user: int = 1000
    lacks: str = "nothing"
    calls: list[str] = field(default_factory=list)
    """Of apt-get, of python and of pip, in order."""

    def make(self, *words: str, terminal: int | None = None) -> subprocess.CompletedProcess[str]:
        """With its programs; `calls` are the new ones then."""
        programs, calls, accepts = self.folder / "programs", self.folder / "calls", self.folder / "accepts"
        programs.mkdir(exist_ok=True)
        calls.write_text("")
        python = PYTHON.format(calls=calls, lacks=self.lacks, venv=self.folder / "venv", accepts=accepts)
        scripts = {"python3.12": python, "id": f"#!/bin/sh\necho {self.user}\n", "apt-get": f'#!/bin/sh\necho "apt-get $*" >> {calls}\n'}
        for path, text in {accepts: "#!/bin/sh\n", **{programs / name: text for name, text in scripts.items()}}.items():
            path.write_text(text)
            path.chmod(0o755)
        variables = [f"VENV={self.folder}/venv", f"PYTHON={programs}/python3.12"]
        command = ["make", "--no-print-directory", *variables, *words]
        environment = {"PATH": f"{programs}:{os.environ['PATH']}"}
        done = subprocess.run(command, cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE, stderr=terminal or subprocess.PIPE)
        self.calls = calls.read_text().splitlines()
        return done

    def installed(self) -> list[str]:
        """What pip was asked for."""
        return [call.partition("constraints.txt ")[2] for call in self.calls if "-m pip" in call]


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.mark.parametrize("lacks", ["ensurepip", "libGL.so.1"])
def test_what_the_system_lacks_is_said_before_anything_is_installed(machine: Machine, lacks: str) -> None:
    machine.lacks = lacks
    refused = machine.make("demo")
    assert refused.returncode
    assert f"sudo apt-get install python3-venv {stated('LIBRARIES')}\n" in refused.stderr
    assert not [call for call in machine.calls if "-m" in call]


def test_root_gets_what_the_system_lacks_and_goes_on(machine: Machine) -> None:
    machine.lacks, machine.user = "ensurepip", 0
    assert not machine.make("demo").returncode
    asked = next(index for index, call in enumerate(machine.calls) if call.startswith("apt-get install"))
    assert machine.calls[asked].endswith(f" python3-venv {stated('LIBRARIES')}")
    assert machine.calls[asked + 1].startswith("-m venv")


@pytest.mark.parametrize("target", ["test", "browser"])
def test_what_the_consoles_tests_need_is_said_before_anything_is_installed(machine: Machine, target: str) -> None:
    machine.lacks = "libatomic.so.1"
    refused = machine.make(target)
    assert refused.returncode
    assert "sudo apt-get install chromium libatomic1\n" in refused.stderr
    assert not [call for call in machine.calls if "-m" in call]


@pytest.mark.parametrize("target", ["demo", "serve"])
def test_the_service_comes_without_the_developers_tools(machine: Machine, target: str) -> None:
    assert not machine.make(target).returncode
    assert machine.installed() == ["--editable .[server]"]
    assert not machine.make(target).returncode
    assert machine.calls == []


def test_the_developers_tools_come_when_they_are_needed(machine: Machine) -> None:
    machine.make("demo")
    assert not machine.make("setup").returncode
    assert machine.installed() == ["--editable .[dev]"]


def test_everything_at_once_leaves_nothing_for_the_demo(machine: Machine) -> None:
    machine.make("setup")
    assert machine.installed() == ["--editable .[dev]"]
    machine.make("demo")
    assert machine.installed() == []


def test_only_torch_is_looked_for_where_torch_is(machine: Machine) -> None:
    machine.make("demo", "TORCH_INDEX=https://torch.example/cpu")
    assert machine.installed() == ["--no-deps --index-url https://torch.example/cpu torch", "--editable .[server]"]


def test_pip_shows_its_progress_on_a_terminal_the_first_time(machine: Machine) -> None:
    other, terminal = pty.openpty()
    quiet = []
    for target in ("demo", "setup"):
        machine.make(target, terminal=terminal)
        quiet.append(any("--quiet" in call for call in machine.calls))
    os.close(terminal)
    os.close(other)
    assert quiet == [False, True]


def test_the_libraries_that_are_looked_for_are_those_of_the_packages() -> None:
    """As Debian names packages of libraries: libX11.so.6 is in libx11-6, libGL.so.1 in libgl1."""
    parts = [name.lower().split(".so.") for name in stated("SONAMES").split()]
    assert [f"{name}-{version}" if name[-1].isdigit() else name + version for name, version in parts] == stated("LIBRARIES").split()


@pytest.mark.parametrize("page", ["README.md", "docs/quickstart.md"])
def test_a_newcomer_reads_of_all_packages_at_once(page: str) -> None:
    assert f"sudo apt-get install python3-venv {stated('LIBRARIES')} git make" in (ROOT / page).read_text()
