"""A service on a Ray of its own, on the synthetic world; started by conftest.py.

Arguments: the memory's folder, the port, and the seconds of a pass of the backbone.
"""

from __future__ import annotations

import logging.config
import sys
import time
from pathlib import Path
from typing import Any

from service.cluster.running import run
from service.logs import config
from service.settings import Settings
from tests.conftest import ColourBackbone


class Slow(ColourBackbone):
    """The synthetic world's; a pass takes a while."""

    def __init__(self, pass_s: float) -> None:
        super().__init__()
        self._pass_s = pass_s

    def extract(self, images: Any) -> Any:
        """See `Backbone.extract`."""
        time.sleep(self._pass_s)
        return super().extract(images)


def main(folder: str, port: str, pass_s: str) -> None:
    """Serves until it is told to stop."""
    logging.config.dictConfig(config("json"))
    settings = Settings(data_dir=Path(folder), port=int(port), variant="ucd", workers=4, queue=16)
    run(settings, Slow(float(pass_s)))


if __name__ == "__main__":
    main(*sys.argv[1:])
