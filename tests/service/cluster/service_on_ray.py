"""A service on the synthetic world, on a Ray of its own or in this process; started by conftest.py and side_by_side.py.

Arguments: `ray` or `here`, the memory's folder, the port, and the seconds that an encoder takes for an image.
"""

from __future__ import annotations

import logging.config
import socket
import sys
import time
from pathlib import Path
from typing import Any

from service.app import create_app
from service.logs import config
from service.server import Server
from service.settings import Settings
from tests.conftest import ColourBackbone


class Slow(ColourBackbone):
    """The synthetic world's; it sleeps in the place of working."""

    def __init__(self, image_s: float) -> None:
        super().__init__()
        self._image_s = image_s

    def extract(self, images: Any) -> Any:
        """See `Backbone.extract`."""
        time.sleep(self._image_s * len(images))
        return super().extract(images)


def main(where: str, folder: str, port: str, image_s: str) -> None:
    """Serves until it is told to stop."""
    logging.config.dictConfig(config("json"))
    settings = Settings(data_dir=Path(folder), port=int(port), variant="ucd", workers=4, queue=16)
    backbone = Slow(float(image_s))
    if where == "ray":
        from service.cluster.running import run

        run(settings, backbone)
    else:
        Server(create_app(settings, backbone=backbone)).run(sockets=[socket.create_server(("127.0.0.1", settings.port))])


if __name__ == "__main__":
    main(*sys.argv[1:])
