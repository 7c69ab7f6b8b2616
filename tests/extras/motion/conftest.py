"""The command line as in tests/daq_cli: no configuration, no runs, a folder of its own."""

from tests.daq_cli.conftest import daq, empty_folder, mock, port

__all__ = ["daq", "empty_folder", "mock", "port"]
