"""`onelook`: the service, a robot's requests, the demo and the benchmarks from a terminal.

Commands import what they need when they run: torch and Open3D take seconds, `onelook --help` does not.
"""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

import typer
from rich.text import Text
from typer.core import TyperGroup

from clients.cli import bench, categories, doctor, keys, memory, rearrange, recordings, render, robot, service, simulate
from clients.cli.terminal import errors
from core.errors import OneLookError

OWN = {"core", "store", "service", "clients", "benchmarks"}
"""This distribution's packages: that one is missing is no matter of extras."""


class OneLookGroup(TyperGroup):
    """Says an expected error in one sentence, and exits with 1."""

    def invoke(self, ctx: Any) -> Any:
        """Runs the command."""
        try:
            return super().invoke(ctx)
        except OneLookError as error:
            _say_error(str(error))
            raise typer.Exit(1) from None
        except ModuleNotFoundError as error:
            library = (error.name or "").split(".")[0]
            if library in OWN:
                raise
            _say_error(f"this command needs {library}, which is not installed; run: pip install 'onelook[server]'")
            raise typer.Exit(1) from None
        except OSError as error:
            if error.filename is None:
                raise
            _say_error(f"{error.filename}: {error.strerror}; name another file or folder")
            raise typer.Exit(1) from None


app = typer.Typer(
    name="onelook",
    cls=OneLookGroup,
    help="A growing memory of object categories: look once, then recognise other objects of the category and say how they are turned.",
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
)


def _say_error(sentence: str) -> None:
    errors.print(Text.assemble(("error: ", "bold red"), sentence), soft_wrap=True)


def _say_version(asked: bool) -> None:
    if asked:
        typer.echo(f"onelook {version('onelook')}")
        raise typer.Exit


@app.callback()
def onelook(
    asked: Annotated[bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Say which version this is.")] = False,
) -> None:
    """What goes before any command."""


app.command("serve", cls=service.ServeCommand)(service.serve)
app.command("doctor")(doctor.doctor)
app.command("observe")(robot.observe)
app.command("scan")(robot.scan)
app.add_typer(categories.app, name="categories")
app.add_typer(memory.app, name="memory")
app.add_typer(keys.app, name="keys")
app.command("simulate")(simulate.simulate)
app.command("rearrange")(rearrange.rearrange)
app.command("render")(render.render)
app.command("samples")(recordings.samples)
app.command("convert")(recordings.convert)
app.add_typer(bench.app, name="bench")


def main() -> None:
    """Entry point of the `onelook` command."""
    app(prog_name="onelook")
