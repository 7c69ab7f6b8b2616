"""The state of the arm under this host, and the actions that its changes ask for, carried out."""

from __future__ import annotations

import threading

from daq.driver import Controller, StopConfirmation
from daq.safety import Action, Arm, Event, State, advance


class ArmControl:
    """One arm. `stop` may come from any thread; everything else from the thread that runs the experiment."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._lock = threading.Lock()
        self._arm = Arm()
        self.handle(Event.CONNECTED)

    @property
    def arm(self) -> Arm:
        """State and cause."""
        return self._arm

    @property
    def may_send(self) -> bool:
        """Whether set points may be sent now."""
        return self._arm.state is State.RUNNING

    def handle(self, event: Event, cause: str | None = None) -> StopConfirmation | None:
        """Takes an event and carries out its actions; returns what became of a freeze, if there was one.

        Raises IllegalEventError, and LinkError when a release cannot be sent.
        """
        with self._lock:
            self._arm, actions = advance(self._arm, event, cause)
        confirmation = None
        for action in actions:
            if action is Action.FREEZE:
                confirmation = self._controller.stop()
            elif action is Action.RELEASE:
                self._controller.release()
        return confirmation

    def stop(self, cause: str) -> StopConfirmation:
        """Freezes the arm at once, from any thread: the stop is on the line before anything else is done."""
        confirmation = self._controller.stop()
        with self._lock:
            self._arm, _ = advance(self._arm, Event.STOP, cause)
        return confirmation
