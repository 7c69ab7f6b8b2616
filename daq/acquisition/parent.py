"""The other side of the acquisition process: starts it, hears its reports, asks it to stop."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from types import TracebackType
from typing import Self

from daq.acquisition.messages import REPORT, EventHappened, Failed, Finished, Job, Progress, Sampled
from daq.contracts import exit_codes

GRACE = 8.0
"""Seconds that the process has to close its trace once its parent wants to leave: a second more of samples, a stop that
the link may have to repeat for some, a slow disk."""


class Acquisition:
    """A running acquisition process. Iterate for its reports; the last is `Finished` or `Failed`.

    Leaving the `with` block early closes its input, which it takes as the loss of its parent: it freezes the arm,
    records a second more and closes the trace as interrupted.
    """

    def __init__(self, job: Job) -> None:
        # Its own session: Ctrl-C in the terminal reaches the parent, which passes on a stop.
        self._process = subprocess.Popen(
            [sys.executable, "-m", "daq.acquisition"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._input, self._output = self._process.stdin, self._process.stdout
        with contextlib.suppress(BrokenPipeError):
            self._input.write(job.model_dump_json().encode() + b"\n")
            self._input.flush()

    @property
    def pid(self) -> int:
        """Process identifier of the acquisition process."""
        return self._process.pid

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Both ends: a process that still wants to report must not wait for somebody who no longer listens.
        for pipe in (self._input, self._output):
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
        try:
            self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def __iter__(self) -> Iterator[Progress | EventHappened | Sampled | Finished | Failed]:
        for line in self._output:
            report = REPORT.validate_json(line)
            yield report
            if isinstance(report, Finished | Failed):
                return
        code = self._process.wait()
        end = f"signal {-code}" if code < 0 else f"exit code {code}"
        line_left = "the arm holds its last set point; `daq traces salvage` finishes what was recorded"
        yield Failed(
            message=f"the acquisition process ended without a word ({end}): {line_left}",
            exit_code=exit_codes.PROGRAM_FAULT,
        )

    def stop(self) -> None:
        """Asks for a stop: the process freezes the arm at once, records a second more, and reports the end.

        May be called from a signal handler, again and again: it only writes a few bytes to a pipe.
        """
        with contextlib.suppress(OSError, ValueError):
            os.write(self._input.fileno(), b"stop\n")
