"""Orders on their way from the service to the owner, read on a thread of their own.

An order that ends what runs takes effect at once, through the guardian, whatever the main thread is doing.
"""

from __future__ import annotations

import math
import os
import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from pydantic import ValidationError

from daq.acquisition.guardian import CANCEL
from daq.contracts.errors import SpecError
from firmware_protocol.invalid import first_invalid
from server.owner.messages import (
    ORDER,
    Close,
    Finish,
    HaltRun,
    JogBegin,
    JogDrive,
    LeadBegin,
    Long,
    Open,
    Order,
    Quick,
    RunExperiment,
    RunProgram,
)

LONGEST_ORDER = 256 << 20
"""Bytes: a recorded path of hours."""


class Inbox:
    """Reads orders until the service closes its end, or says `close`.

    closing: the service wants the port back, or is gone
    finish:  the teaching under way is to end in good order
    """

    def __init__(self, descriptor: int) -> None:
        self.closing = threading.Event()
        self.finish = threading.Event()
        self.guardian_end, self._to_guardian = os.pipe()
        self._input = os.fdopen(descriptor, "rb", closefd=False)
        self._waiting: queue.Queue[Long | Quick | None] = queue.Queue()
        self._lock = threading.Lock()
        self._drive: JogDrive | None = None
        self._said = -math.inf
        """When the newest jog command was said."""
        self._long = 0
        """Long orders that wait or run: while there are any, the loss of the service is a reason to freeze."""
        self._thread = threading.Thread(target=self._read_all, name="inbox", daemon=True)

    def first(self) -> Open:
        """The first order. Raises SpecError when it is not the one that says which robot."""
        line = self._input.readline(LONGEST_ORDER)
        try:
            return Open.model_validate_json(line)
        except ValidationError as error:
            raise SpecError(f"owner: the first order: {first_invalid(error).message}") from error

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Orders are read within. The thread ends with the input, or with the process."""
        self._thread.start()
        yield

    def take(self, patience: float = 0.0) -> Long | Quick | None:
        """The next order that waits; None when none comes within `patience` s, or the service is leaving."""
        try:
            return self._waiting.get(timeout=patience) if patience else self._waiting.get_nowait()
        except queue.Empty:
            return None

    def drive(self) -> JogDrive | None:
        """The newest jog command, once."""
        with self._lock:
            command, self._drive = self._drive, None
        return command

    def done(self) -> None:
        """A long order has been carried out, or refused."""
        with self._lock:
            self._long -= 1

    def _read_all(self) -> None:
        told = False
        try:
            while line := self._input.readline(LONGEST_ORDER):
                order = ORDER.validate_json(line)
                if isinstance(order, Close):
                    told = True
                    break
                self._put(order)
        finally:
            self.closing.set()
            self.finish.set()
            self._waiting.put(None)
            self._leave(told)

    def _put(self, order: Order) -> None:
        match order:
            case HaltRun():
                self._end_what_runs(CANCEL)
            case Finish():
                self.finish.set()
            case JogDrive():
                with self._lock:
                    if order.said >= self._said:  # one that a newer one has overtaken drives nothing
                        self._drive, self._said = order, order.said
            case Open() | Close():
                raise SpecError("owner: this robot is open already")
            case RunExperiment() | JogBegin() | RunProgram() | LeadBegin():
                with self._lock:
                    if not self._long:  # else that word, and that command, are for what still goes on
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

    def _leave(self, told: bool) -> None:
        """The guardian takes the end of its pipe as the loss of whoever started the work."""
        if told:
            self._end_what_runs(b"stop\n")
        elif self._long:
            os.close(self._to_guardian)
