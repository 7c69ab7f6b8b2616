"""A robot whose port this process holds itself, to measure at its registers. It can be stopped like any run."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.limp import GAINS_UNKNOWN, require_drive
from daq.driver import Controller
from daq.owner.session import PortSession, port_session
from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.preparation import Consent, MissingConsentError, require_not_stopped
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console

if TYPE_CHECKING:
    from firmware_protocol.memory_map import MemoryMap

Made = TypeVar("Made")


@dataclass(frozen=True)
class HeldArm:
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
def held_arm(
    call: Invocation, asked: ConsentPrompt, prepare: Callable[[HeldArm], Made]
) -> Iterator[tuple[HeldArm, Made]]:
    """The robot, whose port this process holds. If a real arm needs consent and a person can be asked, it asks.

    `prepare` makes checks before anything moves; if it refuses, set points and gains stay as they were. Enter on the
    main thread. Whatever ends the block early freezes the arm.
    """
    from daq.config.robot_files import load_memory_map

    robot, memory_map = call.settings.robot.name, load_memory_map(call.settings.robot.memory_map)
    with ExitStack() as entered:

        def hold(moves_real_arm: bool) -> HeldArm:
            return entered.enter_context(_held(robot, call.port, memory_map, Consent(moves_real_arm)))

        try:
            held = hold(asked.given)
        except MissingConsentError:  # no process has the port while the operator is asked
            if not asked.for_gains_of(memory_map).agreed(call.port):
                raise
            held = hold(True)
        try:
            gains = held.controller.gains()
            require_drive(gains)
            if not gains:
                console().print(GAINS_UNKNOWN)
            prepared = prepare(held)
        except (SafetyError, SpecError):
            entered.close()  # without the error, which would freeze the arm
            raise
        yield held, prepared


@contextmanager
def _held(robot: str, url: str, memory_map: MemoryMap, consent: Consent) -> Iterator[HeldArm]:
    """Raises MissingConsentError for a real arm that nobody has agreed to move, SafetyError for one that has been
    stopped, StoppedError when a stop came before it was reached, LinkError."""
    with stopped_by_ctrl_z(), port_session(Controller.connect, robot, url, memory_map) as session:
        consent.require(session.controller)
        require_not_stopped(session.controller)
        control = session.take_control()
        if (cause := session.end_cause()) is not None:
            control.stop(cause)
            raise StoppedError(cause)
        with control.frozen_on_error():
            yield HeldArm(session, control)


@contextmanager
def stopped_by_ctrl_z() -> Iterator[None]:
    """With a handler of Python's own, the guardian's wake-up pipe hears of Ctrl-Z as it does of Ctrl-C: a process that
    the terminal has suspended could not be asked for a stop."""
    before = signal.signal(signal.SIGTSTP, lambda _number, _frame: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)
