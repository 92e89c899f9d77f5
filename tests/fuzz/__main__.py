"""`python -m tests.fuzz --seconds 600`: libFuzzer on each target in turn; what it finds is kept and makes it exit 1."""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.targets import CORPUS, TARGETS

ONE_INPUT_S, MEMORY_MB, LARGEST = 20, 3000, 65_536
"""What one input may take, and the most bytes of one."""
PROGRESS_S = 5


def fuzz(name: str, seconds: int, found: Path) -> bool:
    """Whether a target stood it for so long."""
    with TemporaryDirectory() as folder:
        for seed in CORPUS.rglob(f"{name}-*"):
            (Path(folder) / seed.name).write_bytes(seed.read_bytes())
        command = [sys.executable, "-W", "ignore", "-m", "tests.fuzz.one", name, folder, f"-artifact_prefix={found}/{name}-"]
        command += [f"-max_total_time={seconds}", f"-timeout={ONE_INPUT_S}", f"-rss_limit_mb={MEMORY_MB}", f"-max_len={LARGEST}"]
        with (found / f"{name}.log").open("w+") as log, subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT) as process:
            started: float | None = None
            while process.poll() is None:
                time.sleep(PROGRESS_S if seconds > PROGRESS_S else 1)
                tried, coverage = progress(Path(log.name).read_text(errors="replace"))
                if started is None and tried:  # before, it takes everything apart to see what is reached
                    started = time.monotonic()
                passed = 0.0 if started is None else time.monotonic() - started
                sys.stderr.write(f"\r{name:10} {passed:5.0f} of {seconds} s, {tried:>9} inputs, coverage {coverage:>6} ")
                sys.stderr.flush()
    sys.stderr.write("ok\n" if process.returncode == 0 else f"FOUND, see {found / name}.log\n")
    return process.returncode == 0


def progress(log: str) -> tuple[int, int]:
    """Inputs tried, and places reached."""
    told = re.findall(r"^#(\d+)\s.*?cov: (\d+)", log, re.MULTILINE)
    return (int(told[-1][0]), int(told[-1][1])) if told else (0, 0)


def main() -> int:
    """All targets, or some, one after the other."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("targets", nargs="*", default=list(TARGETS), metavar="TARGET", help=", ".join(TARGETS))
    arguments.add_argument("--seconds", type=int, default=600, help="for all targets together")
    arguments.add_argument("--found", type=Path, default=Path("out/fuzz"), help="folder of the logs and of inputs that broke something")
    chosen = arguments.parse_args()
    if find_spec("atheris") is None:
        sys.stderr.write("atheris is missing, which there is for Linux on x86-64 only; tests/fuzz/test_targets.py runs everywhere\n")
        return 2
    chosen.found.mkdir(parents=True, exist_ok=True)
    each = max(1, chosen.seconds // len(chosen.targets))
    stood = [fuzz(name, each, chosen.found) for name in chosen.targets]
    return 0 if all(stood) else 1


if __name__ == "__main__":
    sys.exit(main())
