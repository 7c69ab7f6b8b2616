"""The state machine of the arm on this host; carries out the actions that state changes require."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.driver import Controller, StopConfirmation
from daq.safety import Action, Arm, Event, State, advance

_ORDERLY = (Event.ARM, Event.START, Event.FINISHED, Event.DISARM)
"""Events of an undisturbed run; all are refused once the arm has been halted."""


class StoppedError(DaqError):
    """The arm was stopped; the operation does not continue. `cause`: the reason, without "the arm was stopped"."""

    exit_code = exit_codes.STOPPED

    def __init__(self, cause: str, line: str | None = None) -> None:
        super().__init__(line or f"the arm has been stopped: {cause}")
        self.cause = cause


class ArmControl:
    """One arm. `stop` may be called from any thread; everything else from the thread that runs the experiment.

    A halt (a stop, a trip, a lost link) is stored before it is written to the line. From then on nothing here starts a
    motion or releases a freeze, until an explicit RESET.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._lock = threading.Lock()
        self._arm = Arm()
        self._halted: str | None = None
        self._frozen = False
        self.freezes = 0
        """Number of stops that were sent and answered, or given up."""
        self.unconfirmed = ""
        """What became of the newest stop, if the board has not confirmed it; a reset ends it."""
        self.handle(Event.CONNECTED)

    @property
    def arm(self) -> Arm:
        """State and cause."""
        return self._arm

    @property
    def halted(self) -> str | None:
        """Why the arm was halted since the last reset; None if it was not."""
        return self._halted

    @property
    def may_send(self) -> bool:
        """Whether set points may be sent now."""
        return self._arm.state is State.RUNNING and self._halted is None

    def handle(self, event: Event, cause: str | None = None, stop: int = 0) -> StopConfirmation | None:
        """Applies an event and carries out its actions; returns the result of a freeze, if there was one. A RESET ends
        the stop of number `stop` and no other.

        Raises StoppedError for an event of an undisturbed run if the arm was halted meanwhile, IllegalEventError,
        LinkError if a release cannot be sent, and RequestRefusedError if there is a newer stop.
        """
        with self._lock:
            if event in _ORDERLY:
                self.require_not_halted()
            self._arm, actions = advance(self._arm, event, cause)
            if event is Event.RESET:
                self._halted, self._frozen = None, False
            if Action.FREEZE in actions:
                self._halted = self._halted or cause or event.value
        confirmation = None
        for action in actions:
            if action is Action.FREEZE:
                confirmation = self._freeze()
            elif action is Action.RELEASE:
                self._release(stop)
        return confirmation

    def stop(self, cause: str) -> StopConfirmation:
        """Freezes the arm at once, from any thread: the stop is written before any lock is acquired."""
        self._halted = self._halted or cause
        confirmation = self._freeze()
        with self._lock:
            self._arm, _ = advance(self._arm, Event.STOP, cause)
        return confirmation

    @contextmanager
    def frozen_on_error(self) -> Iterator[None]:
        """Freezes the arm first if an exception ends the block."""
        try:
            yield
        except BaseException as error:
            if not self._frozen:
                self.stop(error.cause if isinstance(error, StoppedError) else f"{type(error).__name__}: {error}")
            raise

    def _freeze(self) -> StopConfirmation:
        confirmation = self._controller.stop()
        self.freezes += 1
        self._frozen = self._frozen or confirmation.acknowledged
        self.unconfirmed = "" if confirmation.acknowledged else stop_line(confirmation)
        return confirmation

    def _release(self, stop: int) -> None:
        self._controller.release(stop)
        if self._halted is not None:
            # A stop was written while the release was on its way, and the release may have undone it.
            self._controller.stop()
            self.require_not_halted()
        self.unconfirmed = ""

    def require_not_halted(self) -> None:
        """Raises StoppedError if the arm was halted."""
        if self._halted is not None:
            raise StoppedError(self._halted)


def stop_line(confirmation: StopConfirmation) -> str:
    """Returns a line about the result of a stop."""
    if confirmation.acknowledged:
        return f"the board confirmed: set points are frozen since tick {confirmation.tick}"
    sent = "was sent but NOT CONFIRMED" if confirmation.sent else "could NOT BE DELIVERED"
    return f"the stop {sent} ({confirmation.problem}): the arm holds its last set point; use the emergency stop"
