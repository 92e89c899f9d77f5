"""Dependencies point one way, and the method stays pure.

core ← store ← service          what a service is made of
core ← clients ← benchmarks     what talks to a service, or measures
clients.cli                     starts any of them: the one place that may import all, when a command runs
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2]
ALLOWED = {
    "core": set(),
    "store": {"core"},
    "service": {"core", "store"},
    "clients": {"core"},
    "benchmarks": {"core", "clients"},
}
"""The packages that each package may import besides itself."""
COMMANDS = "clients.cli"
"""Its modules may import everything, but only inside functions: `onelook --help` must not wait for torch."""
LEARNING = {"torch", "transformers", "open3d", "onnx", "safetensors"}
WEB = {"fastapi", "starlette", "uvicorn", "httpx", "httpx2"}
DATABASE = {"sqlite3", "sqlite_utils"}
TERMINAL = {"typer", "rich"}
FOREIGN = {
    "core": WEB | DATABASE | TERMINAL,
    "store": WEB | TERMINAL | LEARNING,
    "service": {"httpx", "httpx2", "sqlite3", "sqlite_utils"} | TERMINAL,
    "clients": {"fastapi", "starlette"} | DATABASE | LEARNING,
    "benchmarks": WEB | DATABASE,
}
"""Libraries that are another package's business."""
RAYCAST = "clients.simulator.raycast"
"""The rendered world: the one part of clients/ that casts rays, with Open3D."""
DISTRIBUTIONS = {"PIL": "pillow", "cv2": "opencv-python-headless", "open3d": "open3d-cpu", "yaml": "pyyaml", "skimage": "scikit-image"}
"""Of libraries that are imported under another name than they are installed."""
FILE_CALLS = {
    "open",
    "imread",
    "imwrite",
    "read_text",
    "write_text",
    "read_bytes",
    "write_bytes",
    "savez",
    "savez_compressed",
    "mkdir",
    "unlink",
}
FILE_ATTRIBUTES = {("np", "load"), ("np", "save"), ("torch", "load"), ("torch", "save"), ("json", "load"), ("json", "dump")}
WEIGHTS = ROOT / "core" / "backbones"
"""Reads weights, which come from a cache, and their statistics."""
STATISTICS = (ROOT / "core" / "calibration.py", ROOT / "core" / "confidence.py")
"""Read the figures that ship. Nothing else in core/ touches files."""

Import = tuple[str, bool]
"""The imported module, and whether it is imported at module level."""


def modules(package: str) -> list[Path]:
    """Every source file of a package."""
    return sorted((ROOT / package).rglob("*.py"))


def module_name(path: Path) -> str:
    """`core/pose.py` is `core.pose`."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path) -> Iterator[Import]:
    """Modules that a file imports, except for type checkers only."""
    for node, top in _statements(ast.parse(path.read_text()).body, top=True):
        if isinstance(node, ast.Import):
            yield from ((alias.name, top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import; name the package"
            yield node.module or "", top
            yield from ((f"{node.module}.{alias.name}", top) for alias in node.names)


def _statements(body: list[ast.stmt], top: bool) -> Iterator[tuple[ast.stmt, bool]]:
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node, top
        inner = top and not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        for field in ("body", "orelse", "finalbody"):
            yield from _statements(getattr(node, field, []), inner)
        for handler in getattr(node, "handlers", []):
            yield from _statements(handler.body, inner)


@pytest.mark.parametrize("package", ALLOWED)
def test_packages_import_only_what_is_below_them(package: str) -> None:
    forbidden = set(ALLOWED) - ALLOWED[package] - {package}
    wrong = [
        f"{module_name(path)} imports {name}"
        for path in modules(package)
        for name, top in imports(path)
        if name.split(".")[0] in forbidden and (top or not module_name(path).startswith(COMMANDS))
    ]
    assert not wrong


@pytest.mark.parametrize("package", FOREIGN)
def test_libraries_stay_where_they_belong(package: str) -> None:
    wrong = [
        f"{module_name(path)} imports {name}"
        for path in modules(package)
        for name, _ in imports(path)
        if name.split(".")[0] in FOREIGN[package] - ({"open3d"} if module_name(path).startswith(RAYCAST) else set())
        and not module_name(path).startswith(COMMANDS)
    ]
    assert not wrong


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def declared(*extras: str) -> set[str]:
    """Distributions that an installation with these extras names itself."""
    listed = [*PROJECT["dependencies"], *(each for extra in extras for each in PROJECT["optional-dependencies"][extra])]
    return {re.split(r"[=;\[ ]", each)[0].lower() for each in listed}


def distributions(names: set[str]) -> set[str]:
    """What the third-party modules among `names` are installed as."""
    libraries = {name.split(".")[0] for name in names} - {*ALLOWED, *sys.stdlib_module_names}
    return {DISTRIBUTIONS.get(each, each.replace("_", "-")) for each in libraries}


@pytest.mark.parametrize("package", ALLOWED)
def test_what_is_imported_is_a_direct_dependency(package: str) -> None:
    imported = {name for path in modules(package) for name, _ in imports(path)}
    assert distributions(imported) <= declared("cli", "server", "cluster", "colmap", "realsense")


def test_core_touches_no_files_but_weights() -> None:
    wrong = [
        f"{module_name(path)}:{node.lineno} calls {ast.unparse(node.func)}"
        for path in modules("core")
        if not path.is_relative_to(WEIGHTS) and path not in STATISTICS
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and _touches_files(node.func)
    ]
    assert not wrong


def _touches_files(function: ast.expr) -> bool:
    if isinstance(function, ast.Name):
        return function.id in FILE_CALLS
    if isinstance(function, ast.Attribute):
        owner = function.value.id if isinstance(function.value, ast.Name) else ""
        return function.attr in FILE_CALLS or (owner, function.attr) in FILE_ATTRIBUTES
    return False


def test_a_robots_computer_gets_little() -> None:
    """A new library here is megabytes on every robot: docs/robot.md says how many there are."""
    assert declared() == {"httpx", "numpy", "simplejpeg", "websockets"}


PARTS = [("clients.robot", ()), ("clients.asynchronous", ()), ("clients.command", ()), ("clients.cli", ("cli",))]


@pytest.mark.parametrize(("start", "extras"), PARTS)
def test_an_installation_has_what_its_part_imports(start: str, extras: tuple[str, ...]) -> None:
    """What is imported all the way down comes with the distribution, or with the extra: a robot's computer has no torch."""
    known = {module_name(path): path for package in ALLOWED for path in modules(package)}
    reached, waiting = set(), [start]
    while waiting:
        name = waiting.pop()
        if name in reached or name not in known:
            continue
        reached.add(name)
        waiting += [imported for imported, top in imports(known[name]) if top]
        libraries = {imported for imported, top in imports(known[name]) if top}
        assert distributions(libraries) <= declared(*extras), f"{name} imports what only another extra brings"
    assert reached >= {start}


@pytest.mark.parametrize("package", ALLOWED)
def test_files_are_small(package: str) -> None:
    long = [f"{module_name(path)} has {count} lines" for path in modules(package) if (count := len(path.read_text().splitlines())) > 320]
    assert not long, "there is a second noun in it"
