"""Opens a robot's port, and accepts stop requests from before it is opened until nothing can move any more.

Entered in this order: the thread that carries out a stop, the stop socket, the guardian, the port. They are left in
reverse order, except that the port closes last, after every sender of a stop was answered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Generic, TypeVar

from daq.contracts.frozen import build_records
from daq.driver import Controller
from daq.owner.freezer import Freezer
from daq.owner.guardian import Guardian
from daq.owner.stop_socket import stop_listener
from daq.runner.arm_control import ArmControl
from firmware_protocol.memory_map import MemoryMap

C = TypeVar("C", bound=Controller)


@dataclass(frozen=True)
class PortSession(Generic[C]):
    """A connected controller, and the guardian that receives every request to end the work."""

    controller: C
    guardian: Guardian
    _freezer: Freezer

    def take_control(self) -> ArmControl:
        """Returns the arm's state machine. From now on a stop freezes the arm itself; before, it only ended the
        work."""
        control = self._freezer.control = ArmControl(self.controller)
        return control

    def end_cause(self) -> str | None:
        """Why the work must end (`daq stop`, a signal, the parent process); None if it need not."""
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
    guarded: Callable[[Guardian], None] = lambda _guardian: None,
) -> Iterator[PortSession[C]]:
    """Opens the port at `url`; the guardian listens from before that until nothing can move any more.

    After the end, `daq stop` finds no socket here and opens the port itself. Enter on the main thread.

    Args:
        connect: opens the port and connects to the controller, such as `Controller.connect`.
        parent: descriptor of the parent's pipe. Any byte is a stop; the end of the pipe means that the parent is gone.
        guarded: called with the guardian before the port is opened.

    Raises ReachError if the stop socket cannot be made, LinkError if the robot cannot be reached.
    """
    build_records()  # build the validators now, so that nothing time-critical waits for them later
    with (
        ExitStack() as closed_last,
        Freezer(robot, url) as freezer,
        stop_listener(robot) as listener,
        Guardian(listener, parent, freezer.freeze) as guardian,
    ):
        guarded(guardian)
        controller = connect(url, memory_map)
        closed_last.enter_context(controller)
        yield PortSession(controller, guardian, freezer)
