"""Owners for tests: what they are told, what they say."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from daq.contracts.experiment import ExperimentSpec, Pause
from daq.contracts.machine import load_machine
from daq.owner.messages import REPORT, Answer, CannotOpen, Close, EventHappened, Open, Opened, Report, RunExperiment

ENDLESS = ExperimentSpec(trajectory=Pause(duration=3600))
"""Longer than any test: it ends because somebody ends it."""
AFTERMATH_PERIODS = 50


def opening(folder: Path, url: str = "mock://?lock_step=1&seed=3", **more: object) -> Open:
    """A mock of its own, not watched."""
    machine = load_machine("ma2000")
    told = {"url": url, "machine": machine, "limits": machine.limits, "folder": folder, **more}
    return Open.model_validate(told)


@dataclass
class Running:
    """A process under test."""

    process: subprocess.Popen[bytes]

    def say(self, text: str) -> None:
        """Writes a line to it."""
        assert self.process.stdin is not None
        self.process.stdin.write(text.encode() + b"\n")
        self.process.stdin.flush()

    def run(self, spec: ExperimentSpec = ENDLESS) -> None:
        """Has it run an experiment, once its robot is open."""
        assert isinstance(self.report(), Opened)
        self.say(RunExperiment(number=1, asked=time.monotonic(), spec=spec, moves_real_arm=False).model_dump_json())

    def report(self) -> Report:
        assert self.process.stdout is not None
        return REPORT.validate_json(self.process.stdout.readline())

    def until_event(self, kind: str) -> None:
        """Reads until an event of this kind is told."""
        while not (isinstance(report := self.report(), EventHappened) and report.event.kind == kind):
            assert not isinstance(report, Answer | CannotOpen), report

    def end(self) -> Answer | CannotOpen:
        """The answer to the order, or why there is none."""
        while not isinstance(report := self.report(), Answer | CannotOpen):
            pass
        return report

    def close_input(self) -> None:
        """As when the client has gone."""
        assert self.process.stdin is not None
        self.process.stdin.close()

    def exit_code(self) -> int:
        return self.process.wait(20)

    def left(self) -> int:
        """Its exit code, once its client wants the port back."""
        self.say(Close().model_dump_json())
        return self.exit_code()


@contextmanager
def running(text: str, *, before: str = "", runtime: Path | None = None) -> Iterator[Running]:
    """A process that is given `text` (an opening as JSON); `before` is a shell command that sets its limits."""
    command = [sys.executable, "-m", "daq.owner"]
    if before:
        command = ["/bin/sh", "-c", f'{before}; exec "$@"', "sh", *command]
    environment = os.environ | ({"DAQ_RUNTIME_FOLDER": str(runtime)} if runtime else {})
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        made = Running(process)
        made.say(text)
        yield made
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            pipe.close()
