"""The command line: the top of the house. One file a subcommand; heavy libraries are imported where they are used."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Entry point of `daq`. A stop is sent before anything else is imported."""
    if sys.argv[1:2] == ["stop"] and not {"-h", "--help"} & set(sys.argv):
        from daq_cli.app import early_stop

        early_stop.ask(sys.argv[2:])
    # Matrices here are thin: a second thread in each product costs a fifth of a diagnosis. Simulations share the cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from daq.contracts.errors import DaqError
    from daq.contracts.extras import missing_extras_named
    from daq_cli.app.needed import called, extra_of

    command = called(sys.argv[1:])
    try:
        with missing_extras_named(f"daq {command}".strip(), extra_of(command)):
            from daq_cli.app.command import main as run

            run()
    except DaqError as error:  # every other one ends inside `run`
        if command == "stop":  # a client's installation has the early stop alone
            from daq_cli.app import early_stop

            if not early_stop.told():
                early_stop.ask()  # a name that nobody has stops all
            print("\n".join(early_stop.told() or ["NOTHING WAS STOPPED: no program here moves a robot"]), flush=True)
        print(f"daq: {error}", file=sys.stderr)
        raise SystemExit(error.exit_code) from None
