"""Controllers under contract: the mock in lock-step over TCP and in real time through a pseudo-terminal, each with
and without SAMPLE; before the mock's board, the bridge in C, on this computer and on a simulated Mega 2560; and with
`--port URL` a real one.

    pytest tests/contract --port serial:///dev/ttyUSB0                     reads only
    pytest tests/contract --port serial:///dev/ttyUSB0 --allow-motion      moves joints 1-3 by a few posture units
"""

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from daq.driver import Controller
from daq.transport import ByteChannel, MockPort, open_endpoint, parse_port_url
from daq.transport.mock_process import start_mock
from tests.firmware.process import served

MOCKS = {
    "lock-step, tcp": "mock://?lock_step=1&seed=11",
    "lock-step, tcp, no SAMPLE": "mock://?lock_step=1&seed=12&no_sample=1",
    "real time, pty": "mock://?pty=1&seed=13",
    "real time, pty, no SAMPLE": "mock://?pty=1&seed=14&no_sample=1",
}
BRIDGES = {
    "core in C, pty": ("hosted", "--seed", "15"),
    "core in C, pty, no SAMPLE": ("hosted", "--seed", "16", "--no-sample"),
    "Mega 2560, pty": ("mega2560", "--seed", "17"),
}
"""Arguments of tests.firmware.serve."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--allow-motion",
        action="store_true",
        help="with --port: also run the tests that move the arm, by a few posture units",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "motion: moves the arm, or switches its outputs")


@dataclass(frozen=True)
class UnderContract:
    """Where a controller is, and what may be done with it."""

    url: str
    may_move: bool
    control: str | None = None
    """The mock's control port, where it is one."""

    def channel(self) -> ByteChannel:
        """Bytes to and from it, without a driver."""
        return open_endpoint(self.url).connect()


@pytest.fixture(
    scope="module",  # no longer: two of them run in real time, and take a seventh of a processor each
    params=[
        *MOCKS,
        *(pytest.param(name, marks=pytest.mark.slow) for name in BRIDGES),
        pytest.param("hardware", marks=pytest.mark.hardware),
    ],
)
def under_contract(request: pytest.FixtureRequest) -> Iterator[UnderContract]:
    """One running controller of each kind."""
    if request.param == "hardware":
        yield UnderContract(request.config.getoption("--port"), request.config.getoption("--allow-motion", False))
        return
    if request.param in BRIDGES:
        with served(*BRIDGES[request.param]) as bridge:
            yield UnderContract(bridge.url, True, bridge.control)
        return
    port = parse_port_url(MOCKS[request.param])
    assert isinstance(port, MockPort)
    mock = start_mock(port)
    try:
        yield UnderContract(mock.url + ("?lock_step=1" if port.lock_step else ""), True, mock.control)
    finally:
        mock.close()


@pytest.fixture(autouse=True)
def motion_is_allowed(request: pytest.FixtureRequest, under_contract: UnderContract) -> None:
    """Skips what moves the arm where that was not asked for."""
    if request.node.get_closest_marker("motion") and not under_contract.may_move:
        pytest.skip("moves the arm: --allow-motion")


@pytest.fixture
def controller(under_contract: UnderContract) -> Iterator[Controller]:
    """A greeted controller; where it may be moved, it is released before and after."""
    with Controller.connect(under_contract.url) as connected:
        if under_contract.may_move:
            connected.release(connected.status().stop)
        yield connected
        if under_contract.may_move:
            connected.release(connected.status().stop)
