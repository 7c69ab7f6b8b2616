"""The command line, in an empty folder, as in tests/daq_cli."""

from tests.daq_cli.conftest import daq, empty_folder

__all__ = ["daq", "empty_folder"]
