"""The command line. Each subcommand has a file; heavy libraries are imported where they are used."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from typing import NoReturn


def main() -> None:
    """Entry point of `daq`. A stop is sent before other modules are imported."""
    gc.set_threshold(100_000)  # with 700, garbage collection takes a third of the import time and finds nothing
    atexit.register(gc.freeze)  # nor does the one before the end, a tenth of a short command's time
    stopping = sys.argv[1:2] == ["stop"] and not {"-h", "--help"} & set(sys.argv)
    try:
        if stopping:
            from daq_cli.app import early_stop

            early_stop.ask(sys.argv[2:])
        import ma2000  # noqa: F401  # reports a user's file that hides a package; loads nothing else
    except ImportError as error:
        _end(str(error), 2, stopping=stopping)
    if sys.argv[1:] == ["--version"]:  # must work without the packages of the command line
        from importlib.metadata import version

        print(f"daq {version('ma2000-daq')}")
        raise SystemExit(0)
    # Matrices here are small: BLAS threads would slow a diagnosis by a fifth. Simulations use the cores instead.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Looking for pydantic's plug-ins takes longer than loading pydantic.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    from daq.contracts.errors import DaqError
    from daq.contracts.extras import missing_extras_named
    from daq_cli.app.subcommands import called, extra_of

    command = called(sys.argv[1:])
    if command == "run" and not {"-h", "--help", "--dry-run", "--server"} & set(sys.argv):
        from daq.owner.start import start_early

        start_early()  # it loads its modules while this process loads its own
    try:
        with missing_extras_named(f"daq {command}".strip(), extra_of(command)):
            from daq_cli.app.command import main as run

            run()
    except DaqError as error:  # `run` handles every other error
        _end(str(error), error.exit_code, stopping=command == "stop")


def _end(line: str, code: int, *, stopping: bool) -> NoReturn:
    """Ends with one line; after a stop, also with the results of the early stop."""
    if stopping:
        print("\n".join(_stopped() or ["NOTHING WAS STOPPED: no program here moves a robot"]), flush=True)
    print(f"daq: {line}", file=sys.stderr)
    raise SystemExit(code)


def _stopped() -> list[str]:
    """Returns the results of the early stop. Stops now if there was none, or if no robot has the given name."""
    try:
        from daq_cli.app import early_stop
    except ImportError:
        return ["NOTHING WAS STOPPED: the program cannot be loaded"]
    if not early_stop.told():
        early_stop.ask()  # stops all robots, since none has the given name
    return early_stop.told()
