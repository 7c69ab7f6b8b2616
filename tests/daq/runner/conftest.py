"""One mock for all runs of a session: starting one costs more than most runs."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from tests.daq.runner.rig import Rig, rig_on


@pytest.fixture(scope="session")
def running_mock() -> Iterator[MockProcess]:
    """In lock-step."""
    port = parse_port_url("mock://?lock_step=1&seed=5")
    assert isinstance(port, MockPort)
    mock = start_mock(port)
    yield mock
    mock.close()


@pytest.fixture
def arm(running_mock: MockProcess, tmp_path: Path) -> Iterator[Rig]:
    """Everything a run needs, the arm at rest."""
    with rig_on(running_mock, tmp_path) as found:
        yield found
