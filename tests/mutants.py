"""Mutation testing: changes the code in small ways, one at a time, and tells which changes no test notices; run by `make mutants`.

`[tool.mutmut]` in pyproject.toml says what is changed and which tests are asked. Of a file of store/ a sample is tried, drawn with a seed;
`--all` tries every mutant, which takes hours. Afterwards `mutmut show NAME` shows one, and `mutmut run NAME` tries it again.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from mutmut.mutation.diff_apply import get_diff_for_mutant

FOLDER = Path("mutants")
"""Where mutmut keeps its copy of the code, and what it found."""
SAMPLED = {"store": 20}
"""Folders of which so many mutants a file are tried."""
FEWEST = "core.sim3.xǁSim3ǁidentity*"
"""Mutants are made when some are tried."""
SURVIVED, UNTESTED = 0, 33
"""As mutmut notes them."""
SQL = re.compile(r"\b(SELECT|UPDATE|DELETE|WHERE|FROM|PRAGMA|AND|IN|IS|AS)\b|\.insert(_all)?\(|^row = {")


def mutmut(names: Sequence[str]) -> None:
    """Tries mutants by name."""
    subprocess.run([sys.executable, "-m", "mutmut", "run", "--max-children", "1", *names], check=True)


def outcomes() -> dict[Path, dict[str, int | None]]:
    """By file and mutant; None where it was not tried."""
    found = {}
    for meta in sorted(FOLDER.rglob("*.py.meta")):
        if mutants := json.loads(meta.read_text())["exit_code_by_key"]:
            found[meta.relative_to(FOLDER).with_suffix("")] = mutants
    return found


def sample(path: Path, names: Sequence[str]) -> list[str]:
    """Those of a file that are tried."""
    most = SAMPLED.get(path.parts[0], len(names))
    return list(names) if len(names) <= most else random.Random(str(path)).sample(list(names), most)


def changed_lines(name: str, path: Path) -> tuple[str, str]:
    """Before and after."""
    lines = get_diff_for_mutant(name, path=path).splitlines()[2:]
    before, after = ("\n".join(line[1:].strip() for line in lines if line.startswith(sign)) for sign in "-+")
    return before, after


def is_same_sql(before: str, after: str) -> bool:
    """Whether only letters of SQL are large or small, which SQLite does not mind."""
    return bool(SQL.search(before)) and before.lower() == after.lower()


def main() -> None:
    """Tries them, and prints a row for each file and what survived."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--all", action="store_true", help="every mutant of store/ too")
    everything = parser.parse_args().all
    shutil.rmtree(FOLDER, ignore_errors=True)
    mutmut([FEWEST])
    chosen = {path: list(names) if everything else sample(path, sorted(names)) for path, names in outcomes().items()}
    mutmut([name for names in chosen.values() for name in names])
    found = outcomes()
    for path, names in chosen.items():
        alive = {name: changed_lines(name, path) for name in names if found[path][name] in (SURVIVED, UNTESTED)}
        same = [name for name, lines in alive.items() if is_same_sql(*lines)]
        for name, (before, after) in alive.items():
            if name not in same:
                print(f"{name}\n  - {before}\n  + {after}")  # noqa: T201
        told = f"{len(names)} tried, {len(names) - len(alive)} killed, {len(same)} the same SQL, {len(alive) - len(same)} survive"
        print(f"{path}: {len(found[path])} mutants, {told}")  # noqa: T201


if __name__ == "__main__":
    main()
