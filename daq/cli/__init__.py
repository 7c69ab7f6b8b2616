"""The command line: the top of the house. One file a subcommand; heavy libraries are imported where they are used."""

from __future__ import annotations

import sys


def main() -> None:
    """Entry point of `daq`. A stop is asked for before anything else is even imported."""
    if sys.argv[1:2] == ["stop"] and not {"-h", "--help"} & set(sys.argv):
        from daq.cli import early_stop

        early_stop.ask()
    from daq.cli.command import main as run

    run()
