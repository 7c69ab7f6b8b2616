"""A robot held by this process itself, for work that a person leads: teaching. Stoppable like any run."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from daq.acquisition.freezer import Freezer
from daq.acquisition.guardian import Guardian
from daq.acquisition.stop_socket import stop_listener
from daq.contracts.errors import SafetyError
from daq.driver import Controller
from daq.runner import ArmControl, Consent, MissingConsentError, StoppedError
from firmware_protocol.commands import StatusFlag
from firmware_protocol.memory_map import MemoryMap


@dataclass(frozen=True)
class OwnedRobot:
    """A greeted controller, its state, and who may end the work from outside."""

    controller: Controller
    control: ArmControl
    guardian: Guardian

    def ended(self) -> str | None:
        """Why somebody wants the end: `daq stop`, a signal; None while nobody does."""
        return None if self.guardian.cause is None else self.guardian.cause.value


@contextmanager
def owned_robot(robot: str, url: str, memory_map: MemoryMap, consent: Consent) -> Iterator[OwnedRobot]:
    """The robot at `url`, with a stop socket and signals listened to. Enter on the main thread.

    Raises MissingConsentError for a real arm nobody has agreed to move, SafetyError for one that has been stopped,
    StoppedError when a stop came before it was reached, LinkError. Whatever ends the block early freezes the arm.
    """
    with (
        ExitStack() as closed_last,
        Freezer(robot, url) as freezer,
        stop_listener(robot) as listener,
        Guardian(listener, None, freezer.freeze) as guardian,
    ):
        closed_last.enter_context(_stopped_by_ctrl_z())
        controller = closed_last.enter_context(Controller.connect(url, memory_map))
        if not controller.identity.simulated and not consent.moves_real_arm:
            raise MissingConsentError(f"{url} is a real arm: it moves only with the operator's consent (--yes)")
        if StatusFlag.FROZEN in controller.status().flags:
            raise SafetyError("the arm has been stopped and holds its posture; `daq reset` ends that")
        control = freezer.control = ArmControl(controller)
        if guardian.cause is not None:
            control.stop(guardian.cause.value)
            raise StoppedError(f"the arm has been stopped: {guardian.cause.value}")
        with control.frozen_on_error():
            yield OwnedRobot(controller, control, guardian)


@contextmanager
def _stopped_by_ctrl_z() -> Iterator[None]:
    """Ctrl-Z stops the arm like Ctrl-C: put aside, this process could not be asked for a stop. With a handler of
    Python's own the guardian hears of it."""
    before = signal.signal(signal.SIGTSTP, lambda _number, _frame: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)
