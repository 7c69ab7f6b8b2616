"""A robot held by this process itself, for work that a person leads: teaching. It can be stopped like any run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from daq.driver import Controller
from daq.owner.session import PortSession, port_session
from daq.runner import ArmControl, Consent, StoppedError, require_not_stopped
from firmware_protocol.memory_map import MemoryMap


@dataclass(frozen=True)
class OwnedRobot:
    """The session that holds the port, and the arm's state."""

    session: PortSession[Controller]
    control: ArmControl

    @property
    def controller(self) -> Controller:
        """The greeted controller."""
        return self.session.controller

    def end_cause(self) -> str | None:
        """Returns the cause of a requested end (`daq stop`, a signal), or None."""
        return self.session.end_cause()


@contextmanager
def owned_robot(robot: str, url: str, memory_map: MemoryMap, consent: Consent) -> Iterator[OwnedRobot]:
    """The robot at `url`, held by this process. Enter on the main thread.

    Raises MissingConsentError for a real arm that nobody has agreed to move, SafetyError for one that has been stopped,
    StoppedError when a stop came before it was reached, LinkError. Whatever ends the block early freezes the arm.
    """
    with port_session(Controller.connect, robot, url, memory_map, ctrl_z_stops=True) as session:
        consent.require(session.controller)
        require_not_stopped(session.controller)
        control = session.take_control()
        if (cause := session.end_cause()) is not None:
            control.stop(cause)
            raise StoppedError(cause)
        with control.frozen_on_error():
            yield OwnedRobot(session, control)
