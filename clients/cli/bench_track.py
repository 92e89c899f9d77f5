"""The services that `onelook bench track` asks: on this machine, with a close crop of any side."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clients.errors import Unreachable
from clients.simulator.local_service import HOST, STOP_S, becomes_ready, free_port


@contextmanager
def serve(memory: Path, grid: int, warm: bool) -> Iterator[str]:
    """The address of a service that is stopped on leaving. Raises Unreachable where it does not start."""
    port = free_port()
    process = multiprocessing.get_context("spawn").Process(target=_serve, args=(memory, grid, warm, port), daemon=True)
    process.start()
    try:
        if not becomes_ready(address := f"http://{HOST}:{port}", process.is_alive):
            raise Unreachable(f"the service at {address} does not start; `onelook serve` says why")
        yield address
    finally:
        process.terminate()
        process.join(STOP_S)
        if process.is_alive():
            process.kill()
            process.join()


def _serve(memory: Path, grid: int, warm: bool, port: int) -> None:
    import uvicorn

    from core.encode import Encoder, EncoderConfig
    from core.warm import WarmConfig
    from service.app import create_app, warm_backbone
    from service.batching import BatchingBackbone
    from service.compute import Compute
    from service.settings import Settings

    settings = Settings(host=HOST, port=port, data_dir=memory)
    backbone = BatchingBackbone(warm_backbone(settings))
    compute = Compute(backbone, Encoder(backbone, EncoderConfig(grid=grid)))
    app = create_app(settings, compute=compute, warm=WarmConfig() if warm else WarmConfig(sought_anew_after=0))
    uvicorn.run(app, host=HOST, port=port, log_level="warning")
