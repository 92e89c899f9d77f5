"""`onelook serve`."""

from __future__ import annotations

import contextlib
import logging.config
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from clients.cli.terminal import print_facts
from core.errors import InvalidInput, Unavailable

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from service.settings import Settings

log = logging.getLogger("onelook")


class ServeCommand(TyperCommand):
    """Its help lists every setting."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """The options, then the variables."""
        super().format_help(ctx, formatter)
        from service.settings import Settings

        rows = [(f"ONELOOK_{name.upper()}", field) for name, field in Settings.model_fields.items()]
        print_facts({name: f"{field.description} {_default(field)}" for name, field in rows}, title="Settings from the environment")


def _default(field: FieldInfo) -> str:
    if field.default_factory is not None:
        return f"({field.get_default(call_default_factory=True)})"
    return "" if field.default is None else f"({field.default})"


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on; 127.0.0.1 where left out.")] = None,
    port: Annotated[int | None, typer.Option(help="Port; 8000 where left out, 0 takes a free one.")] = None,
    data_dir: Annotated[Path | None, typer.Option(help="Folder of the memory; in the user's data folder where left out.")] = None,
    backbone: Annotated[str | None, typer.Option(help="Name of a backbone, dinov2-s14 where left out, or a folder.")] = None,
    device: Annotated[str | None, typer.Option(help="Torch device: cpu where left out, cuda, cuda:1.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Least similarity of a known object; from the rate where left out.")] = None,
    cluster: Annotated[bool, typer.Option("--cluster", help="On Ray Serve: what computes is in processes of its own.")] = False,
) -> None:
    """Start the service. What has no option here is set by the variables below."""
    from service.logs import config

    given = {"host": host, "port": port, "data_dir": data_dir, "backbone": backbone, "device": device, "threshold": threshold}
    settings = read_settings({name: value for name, value in given.items() if value is not None})
    logging.config.dictConfig(config(settings.log))
    start = _serve_cluster if cluster else _serve_here
    start(settings)


def _serve_here(settings: Settings) -> None:
    with _listener(settings) as listener:
        log.info("loading the backbone %s; this takes a while", settings.backbone)  # before the imports, which are part of it
        from service.app import checked_backbone, create_app
        from service.server import Server

        # Opened once before uvicorn starts, which would wrap the sentence that says what is wrong in a traceback.
        app = create_app(settings, backbone=checked_backbone(settings))
        url = url_of(settings.host, listener.getsockname()[1])
        log.info("serving on %s, memory in %s; Ctrl+C stops it", url, settings.data_dir)
        with contextlib.suppress(KeyboardInterrupt):
            Server(app).run(sockets=[listener])


def _serve_cluster(settings: Settings) -> None:
    try:
        from service.cluster.running import run
    except ModuleNotFoundError as error:
        raise Unavailable(f"--cluster needs {error.name}; install it with: pip install 'onelook[server,cluster]'") from error
    with _listener(settings) as listener:
        port = listener.getsockname()[1]  # Ray Serve binds it itself
    run(settings.model_copy(update={"port": port}))


def read_settings(given: dict[str, object]) -> Settings:
    """The options given, the environment for the rest. Raises InvalidInput."""
    from pydantic import ValidationError

    from service.settings import Settings

    try:
        return Settings(**given)  # type: ignore[arg-type]
    except ValidationError as error:
        first = error.errors()[0]
        name = str(first["loc"][0])
        field = f"--{name.replace('_', '-')}" if name in given else f"ONELOOK_{name.upper()}"
        raise InvalidInput(field, f"{first['msg']}, found {first['input']!r}") from error


def bound(host: str, port: int) -> socket.socket:
    """A socket that has the port but does not listen yet: nobody connects before the service can answer. Raises OSError."""
    listener = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError:
        listener.close()
        raise
    return listener


def _listener(settings: Settings) -> socket.socket:
    """The service's own. Raises Unavailable."""
    try:
        return bound(settings.host, settings.port)
    except OSError as error:
        remedy = "stop what uses it, or choose another one with --port (0 takes a free one) or --host"
        raise Unavailable(f"cannot listen on {settings.host}, port {settings.port} ({error.strerror}); {remedy}") from error


def url_of(host: str, port: int) -> str:
    """Where the service is asked."""
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
