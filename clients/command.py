"""Where `onelook` begins: says what to install where its libraries are missing, since a robot's client comes without them."""

from __future__ import annotations

import sys


def main() -> None:
    """Entry point of the `onelook` command."""
    try:
        from clients.cli import main as run
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] in {"clients", "core"}:
            raise
        sys.exit(f"error: the onelook command needs {error.name}; install it with: pip install 'onelook[cli]'")
    run()
