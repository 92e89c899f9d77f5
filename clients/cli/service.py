"""`onelook serve`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clients.cli.terminal import errors
from core.errors import InvalidInput


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on; 127.0.0.1 where left out.")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 8000 where left out, 0 takes a free one.")] = None,
    data_dir: Annotated[Path | None, typer.Option(help="Folder of the memory; in the user's data folder where left out.")] = None,
    backbone: Annotated[str | None, typer.Option(help="dinov2-s14 (where left out), dino-s8, or a folder of the DINO family.")] = None,
    device: Annotated[str | None, typer.Option(help="Torch device: cpu where left out, cuda, cuda:1.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Least similarity of a known object; the score's own where left out.")] = None,
) -> None:
    """Start the service. Everything else is set by ONELOOK_* in the environment."""
    import logging

    import uvicorn
    from pydantic import ValidationError

    from core.backbones.dino import load_backbone
    from service.app import create_app
    from service.settings import Settings

    given = {"host": host, "port": port, "data_dir": data_dir, "backbone": backbone, "device": device, "threshold": threshold}
    try:
        settings = Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    except ValidationError as error:
        first = error.errors()[0]
        raise InvalidInput(".".join(str(part) for part in first["loc"]), f"{first['msg']}, found {first['input']!r}") from error
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    with errors.status("loading the backbone") as status:
        loaded = load_backbone(settings.backbone, device=settings.device, report=status.update)
    uvicorn.run(create_app(settings, backbone=loaded), host=settings.host, port=settings.port, log_level="info")
