"""Reads orders for the owner on a separate thread.

An order that ends running work goes to the guardian at once, whatever the main thread is doing.
"""

from __future__ import annotations

import math
import os
import queue
import threading
from collections.abc import Callable

from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.owner.guardian import CANCEL
from daq.owner.messages import (
    ORDER,
    Close,
    Finish,
    Freeze,
    HaltRun,
    JogBegin,
    JogDrive,
    LeadBegin,
    LongOrder,
    Open,
    Order,
    QuickOrder,
    RunExperiment,
    RunProgram,
)
from firmware_protocol.invalid import first_invalid

STOP = b"stop\n"
"""Makes the guardian end the work as Ctrl-C does."""
LONGEST_ORDER = 256 << 20
"""Largest order (bytes), enough for a recorded path of hours."""


class Inbox:
    """Reads orders until the client closes its end, or sends `Close`.

    closing: set when the client returns the port, or has died
    finish:  set when the current teaching must end in good order
    freeze:  stops the arm at once and answers, on the inbox's thread
    """

    def __init__(self, descriptor: int) -> None:
        ORDER.rebuild()  # build the validators now, so that no stop waits for them
        self.closing = threading.Event()
        self.finish = threading.Event()
        self.freeze: Callable[[Freeze], None] = lambda _order: None
        self.guardian_end, self._to_guardian = os.pipe()
        self._input = os.fdopen(descriptor, "rb", closefd=False)
        self._waiting: queue.Queue[LongOrder | QuickOrder | None] = queue.Queue()
        self._lock = threading.Lock()
        self._drive: JogDrive | None = None
        self._said = -math.inf
        """Time (s) of the newest jog command."""
        self._long = 0
        """Number of long orders that wait or run. While there are any, losing the client freezes the arm."""
        self._thread = threading.Thread(target=self._read_all, name="inbox", daemon=True)

    def first(self) -> Open:
        """Reads the first order. Raises SpecError if it is not `Open`."""
        line = self._input.readline(LONGEST_ORDER)
        try:
            return Open.model_validate_json(line)
        except ValidationError as error:
            raise SpecError(f"owner: the first order: {first_invalid(error).message}") from error

    def begin(self) -> None:
        """Starts the reading thread. It ends with the input, or with the process."""
        self._thread.start()

    def take(self, patience: float = 0.0) -> LongOrder | QuickOrder | None:
        """Returns the next order; None if none comes within `patience` s, or if the input ends."""
        try:
            return self._waiting.get(timeout=patience) if patience else self._waiting.get_nowait()
        except queue.Empty:
            return None

    def drive(self) -> JogDrive | None:
        """Returns the newest jog command and clears it."""
        with self._lock:
            command, self._drive = self._drive, None
        return command

    def done(self) -> None:
        """Notes that a long order was carried out or refused."""
        with self._lock:
            self._long -= 1

    def _read_all(self) -> None:
        end_reported = False
        try:
            while line := self._input.readline(LONGEST_ORDER):
                order = ORDER.validate_json(line)
                if isinstance(order, Close):
                    end_reported = True
                    break
                self._put(order)
        finally:
            self.closing.set()
            self.finish.set()
            self._waiting.put(None)
            self._leave(end_reported)

    def _put(self, order: Order) -> None:
        match order:
            case HaltRun():
                self._end_what_runs(STOP if order.here else CANCEL)
            case Freeze():
                self.freeze(order)
            case Finish():
                self.finish.set()
            case JogDrive():
                with self._lock:
                    if order.said >= self._said:  # a command that arrives after a newer one is ignored
                        self._drive, self._said = order, order.said
            case Open() | Close():
                raise SpecError("owner: this robot is open already")
            case RunExperiment() | JogBegin() | RunProgram() | LeadBegin():
                with self._lock:
                    if not self._long:  # otherwise the command, or the request to finish, belongs to the running work
                        self._drive = None
                        self.finish.clear()
                    self._long += 1
                self._waiting.put(order)
            case _:
                self._waiting.put(order)

    def _end_what_runs(self, said: bytes) -> None:
        with self._lock:
            if self._long:
                os.write(self._to_guardian, said)

    def _leave(self, end_reported: bool) -> None:
        """Makes the guardian end the work. To the guardian, the end of its pipe means that the client has died."""
        if end_reported:
            self._end_what_runs(STOP)
        elif self._long:
            os.close(self._to_guardian)
