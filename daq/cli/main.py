"""The `daq` command: global options, the list of subcommands, and what every error ends with."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from daq.cli.context import Invocation
from daq.cli.lazy import LazyGroup
from daq.contracts.errors import DaqError
from firmware_protocol.errors import ProtocolError

app = typer.Typer(
    name="daq",
    cls=LazyGroup,
    help="Run experiments on a TQ MA2000 robot arm, or on its mock, and keep every trace.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def options(
    context: typer.Context,
    config_file: Annotated[
        Path | None, typer.Option("--config", help="Configuration file (default: ./daq.toml, then the user's).")
    ] = None,
    port: Annotated[
        str | None,
        typer.Option(help="Robot's port: serial:///dev/ttyUSB0?baud=115200, tcp://host:port or mock://."),
    ] = None,
) -> None:
    """Options that go before the subcommand."""
    context.obj = Invocation(config_file=config_file, port_option=port)


def main() -> None:
    """Entry point: errors that are the user's end in one line on standard error and a documented exit code."""
    try:
        app()
    except DaqError as error:
        fail(str(error), error.exit_code)
    except ProtocolError as error:
        fail(str(error), 2)
    except KeyboardInterrupt:
        fail("interrupted", 130)


def fail(message: str, exit_code: int) -> None:
    """One line on standard error, then the end."""
    print(f"daq: {message}", file=sys.stderr)
    raise SystemExit(exit_code)
