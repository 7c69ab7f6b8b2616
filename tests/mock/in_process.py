"""A mock in lock-step inside the test's own process: for bridges that no command line can start."""

from typing import Any

from mock_controller.bridge.bridge import Bridge
from mock_controller.bridge.link import Link as BridgeLink
from mock_controller.pace import LockStepPace
from mock_controller.timeline import Timeline
from tests.mock.host import make_device


class InProcess:
    """Endpoint and channel at once."""

    lock_step = True
    url = description = "in process"
    bytes_per_second = 1e9
    control = None

    def __init__(self, kind: type[Bridge], *, sample: bool = False) -> None:
        device = make_device(lock_step=True, sample=sample, seed=3)
        self.board = device.board
        self.bridge: Any = kind(Timeline(device.board, device.faults), sees_period=sample, lock_step=True)
        self._pace = LockStepPace(BridgeLink(self.bridge, device.faults))

    def waited(self) -> float:
        return 0.0

    def connect(self) -> "InProcess":
        return self

    def write(self, data: bytes) -> None:
        self._pace.receive(data)

    def read(self, timeout_s: float) -> bytes:
        said = self._pace.work()
        while not said and self._pace.timeout_s() == 0.0:
            said = self._pace.work()
        return said

    def close(self) -> None:
        """Nothing to close."""
