"""Ray and Ray Serve, started and ended."""

from __future__ import annotations

import logging
import os
import secrets
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ALONE = "RAY_ADDRESS" not in os.environ
"""Whether Ray is to be started here, for this machine alone."""
os.environ.update(
    {
        "RAY_USAGE_STATS_ENABLED": "0",  # nothing is told to anybody
        "RAY_DEDUP_LOGS": "0",
        "RAY_COLOR_PREFIX": "0",
        "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    }
)
if ALONE:
    os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # on Linux, too, this is Ray's word for 127.0.0.1
    os.environ.update({"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)})  # some of its ports listen elsewhere, too

import ray  # noqa: E402  reads them
from ray import serve  # noqa: E402
from ray.serve.schema import LoggingConfig  # noqa: E402

from core.backbones.base import Backbone  # noqa: E402
from core.errors import Unavailable  # noqa: E402
from service.app import require_startable  # noqa: E402
from service.cluster.application import application  # noqa: E402
from service.cluster.remote import APPLICATION  # noqa: E402
from service.settings import Settings  # noqa: E402

log = logging.getLogger("onelook")


def run(settings: Settings, backbone: Backbone | None = None) -> None:
    """Serves until SIGTERM or Ctrl+C: on the Ray that RAY_ADDRESS names, else on one of its own, for this machine alone.

    Raises what keeps the service from starting.
    """
    require_startable(settings)
    with _ray():
        quiet = LoggingConfig(log_level="WARNING", enable_access_log=False)
        serve.start(http_options={"host": settings.host, "port": settings.port}, logging_config=quiet)
        try:
            serve.run(application(settings, backbone), name=APPLICATION, logging_config=quiet)
        except RuntimeError as error:
            raise Unavailable(f"Ray Serve could not start the service ({error}); the lines above say why") from error
        log.info("serving on http://%s:%d, memory in %s; Ctrl+C stops it", settings.host, settings.port, settings.data_dir)
        _told_to_stop().wait()
        log.info("stopping")


def _told_to_stop() -> threading.Event:
    over = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    return over


@contextmanager
def _ray() -> Iterator[None]:
    ray.init(include_dashboard=False) if ALONE else ray.init()
    try:
        yield
    finally:
        serve.shutdown()  # type: ignore[no-untyped-call]
        ray.shutdown()
