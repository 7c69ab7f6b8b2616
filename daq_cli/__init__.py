"""The command line: the top of the house. One file a subcommand; heavy libraries are imported where they are used."""

from __future__ import annotations

import gc
import os
import sys
from typing import NoReturn


def main() -> None:
    """Entry point of `daq`. A stop is sent before anything else is imported."""
    gc.set_threshold(100_000)  # with 700, collections take a third of the imports' time, and find nothing
    stopping = sys.argv[1:2] == ["stop"] and not {"-h", "--help"} & set(sys.argv)
    try:
        if stopping:
            from daq_cli.app import early_stop

            early_stop.ask(sys.argv[2:])
        import ma2000  # noqa: F401 - says in one line which file of the user's hides a package; loads nothing else
    except ImportError as error:
        _end(str(error), 2, stopping=stopping)
    if sys.argv[1:] == ["--version"]:  # asked of every installation, also of one without the command line's packages
        from importlib.metadata import version

        print(f"daq {version('ma2000-daq')}")
        raise SystemExit(0)
    # Matrices here are thin: a second thread in each product costs a fifth of a diagnosis. Simulations share the cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from daq.contracts.errors import DaqError
    from daq.contracts.extras import missing_extras_named
    from daq_cli.app.subcommands import called, extra_of

    command = called(sys.argv[1:])
    try:
        with missing_extras_named(f"daq {command}".strip(), extra_of(command)):
            from daq_cli.app.command import main as run

            run()
    except DaqError as error:  # every other one ends inside `run`
        _end(str(error), error.exit_code, stopping=command == "stop")


def _end(line: str, code: int, *, stopping: bool) -> NoReturn:
    """Ends with one line; after a stop also with what the early stop has reached, all that is left of the command."""
    if stopping:
        print("\n".join(_stopped() or ["NOTHING WAS STOPPED: no program here moves a robot"]), flush=True)
    print(f"daq: {line}", file=sys.stderr)
    raise SystemExit(code)


def _stopped() -> list[str]:
    """What the early stop was told; stops now if there was none, or nobody by the name that was given."""
    try:
        from daq_cli.app import early_stop
    except ImportError:
        return ["NOTHING WAS STOPPED: the program cannot be loaded"]
    if not early_stop.told():
        early_stop.ask()  # a name that nobody has stops all
    return early_stop.told()
