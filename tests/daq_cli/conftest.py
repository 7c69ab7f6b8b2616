"""A command line that knows nothing of whoever runs the tests: no configuration, no runs, a folder of its own."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from daq_cli.app.context import console
from tests.daq_cli.invoke import CommandLine


@pytest.fixture(autouse=True)
def empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Working folder, configuration folder and stop sockets in an empty place."""
    folder = tmp_path / "folder"
    folder.mkdir()
    monkeypatch.chdir(folder)
    for name in [name for name in os.environ if name.startswith("DAQ_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "configuration"))
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", str(tmp_path / "run"))
    monkeypatch.setenv("COLUMNS", "500")
    console.cache_clear()
    yield folder
    console.cache_clear()


@pytest.fixture
def daq(capsys: pytest.CaptureFixture[str]) -> CommandLine:
    return CommandLine(capsys)


@pytest.fixture(scope="session")
def mock() -> Iterator[MockProcess]:
    """A mock in lock-step that commands connect to."""
    port = parse_port_url("mock://?lock_step=1&seed=5")
    assert isinstance(port, MockPort)
    running = start_mock(port)
    yield running
    running.close()


@pytest.fixture
def port(mock: MockProcess) -> str:
    return f"{mock.url}?lock_step=1"
