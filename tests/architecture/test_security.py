"""Nothing that could run what somebody else wrote: no pickles, no evaluated text, no shell."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted(path for package in ("core", "store", "service", "clients", "benchmarks") for path in (ROOT / package).rglob("*.py"))
UNPICKLING = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "jsonpickle"}
RUNNING = {"eval", "exec", "compile", "__import__", "os.system", "os.popen", "subprocess.getoutput", "subprocess.getstatusoutput"}


def violations(source: str) -> Iterator[str]:
    """What a source does that none may."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (f"imports {alias.name}" for alias in node.names if alias.name.split(".")[0] in UNPICKLING)
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in UNPICKLING:
            yield f"imports {node.module}"
        elif isinstance(node, ast.Call):
            yield from _calls(node)


def _calls(call: ast.Call) -> Iterator[str]:
    name = ast.unparse(call.func)
    said = {keyword.arg: ast.unparse(keyword.value) for keyword in call.keywords}
    if name in RUNNING:
        yield f"calls {name}"
    if said.get("shell", "False") != "False":
        yield f"calls {name} with a shell"
    if said.get("allow_pickle", "False") != "False":
        yield f"calls {name} with allow_pickle"
    if name == "torch.load" and said.get("weights_only") != "True":
        yield "calls torch.load without weights_only=True"
    if name in {"yaml.load", "yaml.unsafe_load", "yaml.full_load"}:
        yield f"calls {name}: yaml.safe_load reads plain data"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_runs_what_was_sent(path: Path) -> None:
    assert list(violations(path.read_text())) == []


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from dill import loads",
        "np.load(file, allow_pickle=True)",
        "np.savez(file, allow_pickle=True)",
        "torch.load(file)",
        "subprocess.run(text, shell=True)",
        "yaml.load(text)",
        "eval(text)",
    ],
)
def test_the_check_finds_what_it_looks_for(source: str) -> None:
    assert len(list(violations(source))) == 1
