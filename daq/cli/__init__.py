"""The command line: the top of the house. One file a subcommand; heavy libraries are imported where they are used."""

from daq.cli.main import main

__all__ = ["main"]
