"""Keeps a robot connected while requested; retries with doubling delays."""

from __future__ import annotations

import logging
import threading

from daq.contracts.errors import DaqError
from daq.transport import ReconnectDelay
from server.robot.robot import Robot

PATIENCE = 20.0
"""Time (s) for a process to freeze the arm, close its trace and end, on a busy computer."""
DELAYS = ReconnectDelay(first_s=1.0, longest_s=30.0)
log = logging.getLogger("server.robot")


class Keeper:
    """A thread that keeps a robot connected. Connecting moves nothing and continues nothing that was interrupted."""

    def __init__(self, robot: Robot, delays: ReconnectDelay = DELAYS) -> None:
        self._robot = robot
        self._delays = delays
        self._changed = threading.Condition()
        self._wanted = False
        self._closing = False
        self._thread = threading.Thread(target=self._keep, name="robot-keeper", daemon=True)
        robot.disconnected.append(lambda _why: self._wake())

    def start(self, *, connect: bool) -> None:
        """Starts the thread."""
        self._wanted = connect
        self._thread.start()

    def connect(self) -> None:
        """Connects, and keeps the robot connected. Raises ReachError if it cannot be reached; the thread retries.

        A lost link gets a new process: a person asks, and the old one only tries again what has not come back.
        """
        with self._changed:
            self._wanted = True
        if self._robot.connection == "lost":
            self._robot.disconnect(PATIENCE)
        self._robot.connect(anew=True, wanted=self._is_wanted)
        self._wake()

    def disconnect(self) -> bool:
        """Disconnects, after a stop of running work. Returns whether the port is free."""
        with self._changed:
            self._wanted = False
            self._changed.notify_all()
        return self._robot.disconnect(PATIENCE)

    def close(self, patience: float) -> None:
        """Disconnects permanently and ends the thread."""
        with self._changed:
            self._wanted, self._closing = False, True
            self._changed.notify_all()
        if not self._robot.disconnect(patience):
            log.warning("the owner of %s still closes its trace; it ends by itself", self._robot.name)
        if self._thread.is_alive():
            self._thread.join(patience)

    def _is_wanted(self) -> bool:
        return self._wanted

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _keep(self) -> None:
        delays = self._delays.delays()
        while True:
            with self._changed:
                if self._closing:
                    return
                missing = self._wanted and self._robot.connection == "disconnected"
                if not missing:
                    delays = self._delays.delays()
                    self._changed.wait()
                    continue
                if self._changed.wait_for(lambda: self._closing or not self._wanted, next(delays)):
                    continue
            try:
                self._robot.connect(wanted=self._is_wanted)
            except DaqError as error:
                log.warning("robot %s: %s", self._robot.name, error)
            except Exception:  # retry after any error, since nothing else would
                log.exception("robot %s", self._robot.name)
