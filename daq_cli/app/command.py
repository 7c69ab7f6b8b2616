"""The `daq` command: its global options, and exit codes and messages of all errors."""

from __future__ import annotations

import errno
import io
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import MISTAKE, DaqError, SpecError
from daq_cli.app.context import Invocation
from daq_cli.app.lazy import LazyGroup
from daq_cli.app.subcommands import subcommand
from firmware_protocol.errors import ProtocolError
from firmware_protocol.invalid import message_of

WRONG_NAMES = frozenset(
    {
        errno.ENAMETOOLONG,
        errno.ENOENT,
        errno.ENOTDIR,
        errno.EISDIR,
        errno.ELOOP,
        errno.EACCES,
        errno.EPERM,
        errno.EROFS,
    }
)
"""Operating-system errors that a wrong file name causes; all others are faults of the computer."""
LONGEST_LINE = 800
"""Most characters of a printed error: a command line may contain a megabyte."""

SERVER_VARIABLE = "DAQ_SERVER"
UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""typer's exception for an invalid command line, which has no public name."""

app = typer.Typer(
    name="daq",
    cls=LazyGroup,
    help="Run experiments on a TQ MA2000 robot arm, or on its mock, and keep every trace.",
    no_args_is_help=True,
    rich_markup_mode=None,  # importing rich takes longer than everything else in `daq --help`
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"daq {version('ma2000-daq')}")
        raise typer.Exit


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
    robot: Annotated[
        str | None, typer.Option("--robot", help="Name of one of several robots, of daq.toml or of the service.")
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and end.")
    ] = False,
) -> None:
    """Options before the subcommand."""
    del version
    by_default = getattr(context.get_parameter_source("server"), "name", "") == "ENVIRONMENT"
    if server is not None and port is not None:
        if not by_default:
            raise SpecError("--port and --server: the server uses its own port; give one of them")
        server = None
    known = subcommand(context.invoked_subcommand or "")
    about = "robot" if known is None else known.about
    if server is not None and about != "robot":
        if not by_default:
            raise SpecError(f"--server: `daq {context.invoked_subcommand}` has nothing to do with a server's robot")
        server = None
    if robot is not None and about == "service":
        raise SpecError(f"--robot: `daq {context.invoked_subcommand}` is about all robots of the configuration")
    context.obj = Invocation(
        config_file=config_file,
        port_option=port,
        server=server,
        server_by_default=by_default,
        robot_option=robot,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point: a user error ends in one line on standard error and a documented exit code. arguments: as typed
    after `daq`; None for those of this process."""
    _print_whatever_files_are_called()
    # matplotlib warns of a home that is not writable, but draws the figure.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        exit_code = app(arguments, prog_name="daq", standalone_mode=False)
        _flush()  # now, while a failure to write still raises an error
    except DaqError as error:
        fail(str(error), error.exit_code)
    except ProtocolError as error:
        fail(str(error), exit_codes.WRONG_INPUT)
    except UsageError as error:
        _show_usage_error(error)
    except (KeyboardInterrupt, typer.Abort):
        fail("interrupted", exit_codes.INTERRUPTED)
    except MemoryError:
        fail("the computer has not enough memory for this", exit_codes.PROGRAM_FAULT)
    except BrokenPipeError:
        # `daq traces ls | head`: the reader closed the pipe. Python would report an error at exit.
        _drop_output()
        raise SystemExit(exit_codes.PROGRAM_FAULT) from None
    except OSError as error:
        # No other code has handled this error: a name that is too long, an unreadable folder, a full disk.
        file = "" if error.filename is None else f"{error.filename}: "
        _drop_output()
        code = exit_codes.WRONG_INPUT if error.errno in WRONG_NAMES else exit_codes.PROGRAM_FAULT
        fail(f"{file}{error.strerror or error}", code)
    except Exception as error:
        if (line := _line_of_database(error)) is None:
            raise
        fail(line, exit_codes.WRONG_INPUT)
    # typer returns either an exit code or the command's result.
    raise SystemExit(exit_code if isinstance(exit_code, int) else 0)


def _line_of_database(error: Exception) -> str | None:
    """Returns an error of a service's database in one line; None for any other error. Does not import the database
    library if the command has not."""
    library = sys.modules.get("sqlalchemy.exc")
    if library is None or not isinstance(error, library.DatabaseError):
        return None
    from server.database_errors import advice_of, line_of

    return f"database: {line_of(error)}; {advice_of(error)}"


def _flush() -> None:
    """Writes buffered output. Raises OSError. Python has no standard output if the shell closed it (`>&-`)."""
    out: io.TextIOBase | None = sys.stdout  # type: ignore[assignment]
    if out is not None:
        out.flush()


def _drop_output() -> None:
    """Discards output that could not be written; Python would try it again at exit and report an error."""
    try:
        _flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _print_whatever_files_are_called() -> None:
    """Makes output accept file names that are not UTF-8, and degree signs on terminals that lack them."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="surrogateescape" if sys.stdout.encoding.lower() == "utf-8" else "replace")


def _show_usage_error(error: Any) -> NoReturn:
    """Ends with one line about the error in the command line and its help; without an error message, prints the
    help."""
    if getattr(error, "message", ""):  # for some values typer passes on pydantic's message
        error.message = message_of({"msg": error.message})
    message = error.format_message().strip().removesuffix(".")
    if type(error).__name__ == "NoArgsIsHelpError":
        print(message, file=sys.stderr)
        raise SystemExit(exit_codes.WRONG_INPUT)
    path = "daq" if error.ctx is None else error.ctx.command_path
    fail(f"{message} (see `{path} --help`)", exit_codes.WRONG_INPUT)


def fail(message: str, exit_code: int) -> NoReturn:
    """Ends with one line on standard error, and one for each mistake of a machine file. A long line is shortened in
    its middle, because its end states what is allowed."""
    for k, part in enumerate(message.split(MISTAKE)):
        line = " ".join(part.split())
        if len(line) > LONGEST_LINE:
            line = f"{line[: LONGEST_LINE // 2]} … {line[-LONGEST_LINE // 2 :]}"
        shown = "".join(one if one.isprintable() else ascii(one)[1:-1] for one in line)
        print(f"{'  ' if k else 'daq: '}{shown}", file=sys.stderr)
    raise SystemExit(exit_code)
