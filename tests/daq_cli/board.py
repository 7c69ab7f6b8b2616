"""What the board holds, asked behind the command line's back."""

from typing import Any

from daq.transport.mock_process import MockProcess
from tests.control_port import told_by


def ask(mock: MockProcess, do: str) -> dict[str, Any]:
    """The mock's control port."""
    return told_by(mock.control, do)


def held(mock: MockProcess) -> list[object]:
    """What no refused command may change: set points, gains, whether it is frozen."""
    state = ask(mock, "state")
    return [state[name] for name in ("set_points", "gains", "frozen")]
