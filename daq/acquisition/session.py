"""Opens a robot's port; requests for a stop are heard from before it is opened until nothing can move any more.

Entered in this order: the thread that carries out a stop, the stop socket, the guardian that listens, the port. Left in
the reverse order, except the port, which closes last, after everybody who asked for a stop has been answered.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Generic, TypeVar

from daq.acquisition.freezer import Freezer
from daq.acquisition.guardian import Guardian
from daq.acquisition.stop_socket import stop_listener
from daq.contracts.frozen import build_records
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from firmware_protocol.memory_map import MemoryMap

C = TypeVar("C", bound=Controller)


@dataclass(frozen=True)
class PortSession(Generic[C]):
    """A connected controller and the guardian that hears every request to end the work."""

    controller: C
    guardian: Guardian
    _freezer: Freezer

    def take_control(self) -> ArmControl:
        """The arm's state machine. From here on a stop freezes the arm itself; before, it only ended the work."""
        control = self._freezer.control = ArmControl(self.controller)
        return control

    def end_cause(self) -> str | None:
        """Why the work is to end: `daq stop`, a signal, the parent process; None while nobody asks for the end."""
        cause = self.guardian.cause
        return None if cause is None else cause.value


@contextmanager
def port_session(
    connect: Callable[[str, MemoryMap], C],
    robot: str,
    url: str,
    memory_map: MemoryMap,
    *,
    parent: int | None = None,
    ctrl_z_stops: bool = False,
) -> Iterator[PortSession[C]]:
    """Opens the port at `url`, with the guardian listening from before it is opened until nothing can move any more.

    A stop that comes after the end finds nobody here, and opens the port itself. Enter on the main thread.

    Args:
        connect: opens the port and connects to the controller, such as `Controller.connect`.
        parent: descriptor of the parent's pipe: any byte is a stop, its end the loss of the parent.
        ctrl_z_stops: Ctrl-Z counts as a stop. A process that the terminal has suspended could not be asked for one.

    Raises ReachError when the stop socket cannot be made, LinkError when the robot is not reached.
    """
    build_records()  # nothing that keeps time waits for it later
    with (
        ExitStack() as closed_last,
        Freezer(robot, url) as freezer,
        stop_listener(robot) as listener,
        Guardian(listener, parent, freezer.freeze) as guardian,
    ):
        if ctrl_z_stops:
            closed_last.enter_context(_stopped_by_ctrl_z())
        controller = connect(url, memory_map)
        closed_last.enter_context(controller)
        yield PortSession(controller, guardian, freezer)


@contextmanager
def _stopped_by_ctrl_z() -> Iterator[None]:
    """With a handler of Python's own, the guardian's wake-up pipe hears of Ctrl-Z as it does of Ctrl-C."""
    before = signal.signal(signal.SIGTSTP, lambda _number, _frame: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)
