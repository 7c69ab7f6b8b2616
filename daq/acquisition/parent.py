"""The other side of the acquisition process: starts it, hears its reports, asks it to stop."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from types import TracebackType
from typing import Self

from daq.acquisition.messages import REPORT, EventHappened, Failed, Finished, Job, Progress, Sampled

GRACE = 5.0
"""Seconds that the process has to close its trace once its parent wants to leave."""


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
            text=True,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(job.model_dump_json() + "\n")
            self._process.stdin.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        try:
            self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def __iter__(self) -> Iterator[Progress | EventHappened | Sampled | Finished | Failed]:
        assert self._process.stdout is not None
        ended = False
        for line in self._process.stdout:
            report = REPORT.validate_json(line)
            ended = ended or isinstance(report, Finished | Failed)
            yield report
        if not ended:
            code = self._process.wait()
            yield Failed(message=f"the acquisition process ended without a word (exit code {code})", exit_code=1)

    def stop(self) -> None:
        """Asks for a stop: the process freezes the arm at once, records a second more, and reports the end."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError, ValueError):
            self._process.stdin.write("stop\n")
            self._process.stdin.flush()
