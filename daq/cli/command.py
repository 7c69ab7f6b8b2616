"""The `daq` command: global options, the list of subcommands, and what every error ends with."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from daq.cli.context import Invocation
from daq.cli.lazy import HERE, LazyGroup
from daq.contracts.errors import DaqError, SpecError
from firmware_protocol.errors import ProtocolError

EXIT_PROGRAM_FAULT = 1
EXIT_WRONG_INPUT = 2
EXIT_INTERRUPTED = 130
"""As shells report a process that Ctrl-C has ended."""

SERVER_VARIABLE = "DAQ_SERVER"
UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""What typer raises for a command line that it does not understand; it has no public name there."""

app = typer.Typer(
    name="daq",
    cls=LazyGroup,
    help="Run experiments on a TQ MA2000 robot arm, or on its mock, and keep every trace.",
    no_args_is_help=True,
    rich_markup_mode=None,  # importing rich costs more than everything else that `daq --help` does
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
    server: Annotated[
        str | None,
        typer.Option(envvar=SERVER_VARIABLE, help="A service that has the robot: http://host:8300. Token: DAQ_TOKEN."),
    ] = None,
) -> None:
    """Options that go before the subcommand."""
    by_default = getattr(context.get_parameter_source("server"), "name", "") == "ENVIRONMENT"
    if server is not None and port is not None:
        if not by_default:
            raise SpecError("--port and --server: the server has the robot at its own port; give one of them")
        server = None
    if server is not None and context.invoked_subcommand in HERE:
        if not by_default:
            raise SpecError(f"--server: `daq {context.invoked_subcommand}` has nothing to do with a server's robot")
        server = None
    context.obj = Invocation(config_file=config_file, port_option=port, server=server, server_by_default=by_default)


def main() -> None:
    """Entry point: errors that are the user's end in one line on standard error and a documented exit code."""
    try:
        exit_code = app(prog_name="daq", standalone_mode=False)
    except DaqError as error:
        fail(str(error), error.exit_code)
    except ProtocolError as error:
        fail(str(error), EXIT_WRONG_INPUT)
    except UsageError as error:
        _show_usage_error(error)
    except (KeyboardInterrupt, typer.Abort):
        fail("interrupted", EXIT_INTERRUPTED)
    except BrokenPipeError:
        # `daq traces ls | head`: whoever read has enough. Python would complain at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(EXIT_PROGRAM_FAULT) from None
    # typer hands back either an exit code or what the command returned.
    raise SystemExit(exit_code if isinstance(exit_code, int) else 0)


def _show_usage_error(error: Any) -> NoReturn:
    """A command line that cannot be understood: one line, and where help is; the help itself where nothing was said."""
    message = error.format_message().strip()
    if "\n" in message:
        print(message, file=sys.stderr)
        raise SystemExit(EXIT_WRONG_INPUT)
    path = "daq" if error.ctx is None else error.ctx.command_path
    fail(f"{message} (see `{path} --help`)", EXIT_WRONG_INPUT)


def fail(message: str, exit_code: int) -> NoReturn:
    """One line on standard error, then the end."""
    print(f"daq: {' '.join(message.split())}", file=sys.stderr)
    raise SystemExit(exit_code)
