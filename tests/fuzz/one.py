"""`python -m tests.fuzz.one TARGET FOLDER …`: one target under libFuzzer, whose options follow; started by tests/fuzz/__main__.py."""

from __future__ import annotations

import logging
import sys

import atheris

with atheris.instrument_imports(include=["service", "store", "core", "PIL", "python_multipart", "starlette", "zipfile"]):
    from tests.fuzz.targets import attempt


def main() -> None:
    """Until libFuzzer ends it."""
    logging.disable(logging.CRITICAL)
    name = sys.argv.pop(1)
    atheris.Setup(sys.argv, lambda content: attempt(name, content))
    atheris.Fuzz()


if __name__ == "__main__":
    main()
