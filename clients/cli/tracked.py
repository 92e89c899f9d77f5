"""The services that `onelook bench track` asks: on this machine, with a close crop of any side."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from clients.errors import Unreachable

HOST = "127.0.0.1"
START_S = 300.0
POLL_S = 0.2
STOP_S = 10.0


@contextmanager
def serve(memory: Path, grid: int, warm: bool) -> Iterator[str]:
    """The address of a service that is stopped on leaving. Raises Unreachable where it does not start."""
    from clients.simulator.local_service import free_port

    port = free_port()
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=(memory, grid, warm, port), daemon=True)
    process.start()
    try:
        _wait(process, address := f"http://{HOST}:{port}")
        yield address
    finally:
        process.terminate()
        process.join(STOP_S)
        if process.is_alive():
            process.kill()
            process.join()


def _wait(process: multiprocessing.process.BaseProcess, address: str) -> None:
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline and process.is_alive():
        try:
            if httpx.get(f"{address}/readyz", timeout=2).is_success:
                return
        except httpx.TransportError:
            pass
        time.sleep(POLL_S)
    raise Unreachable(f"the service at {address} does not start; `onelook serve` says why")


def _serve(memory: Path, grid: int, warm: bool, port: int) -> None:
    import uvicorn

    from core.encode import Encoder, EncoderConfig
    from service import tracker
    from service.app import create_app, warm_backbone
    from service.batching import BatchingBackbone
    from service.compute import Compute
    from service.settings import Settings

    if not warm:
        tracker.SOUGHT_ANEW_AFTER = 0
    settings = Settings(host=HOST, port=port, data_dir=memory)
    backbone = BatchingBackbone(warm_backbone(settings))
    compute = Compute(backbone, Encoder(backbone, EncoderConfig(grid=grid)))
    uvicorn.run(create_app(settings, compute=compute), host=HOST, port=port, log_level="warning")
