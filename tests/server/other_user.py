"""The command line of another user of a service, in a folder of their own with nothing in it."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq_cli.app.context import console
from tests.daq_cli.invoke import CommandLine


def environment_in(folder: Path) -> dict[str, str]:
    """Of a process that knows no configuration but one in `folder`."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith("DAQ_")}
    return kept | {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}


@contextmanager
def other_users_command_line(
    folder: Path, capture: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[CommandLine]:
    """`daq` as it is typed in `folder`."""
    for name in [name for name in os.environ if name.startswith("DAQ_")]:
        monkeypatch.delenv(name)
    for name, value in environment_in(folder).items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("COLUMNS", "500")
    monkeypatch.chdir(folder)
    console.cache_clear()
    yield CommandLine(capture)
    console.cache_clear()
