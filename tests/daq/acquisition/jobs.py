"""Acquisition processes for tests: what they are told, what they say."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from daq.acquisition.messages import REPORT, EventHappened, Failed, Finished, Job, Progress, Sampled
from daq.contracts.experiment import ExperimentSpec, Pause
from daq.contracts.machine import load_machine

ENDLESS = ExperimentSpec(trajectory=Pause(duration=3600))
"""Longer than any test: it ends because somebody ends it."""
AFTERMATH_PERIODS = 50


def job(folder: Path, spec: ExperimentSpec = ENDLESS, url: str = "mock://?lock_step=1&seed=3", **more: object) -> Job:
    """A job on a mock of its own."""
    machine = load_machine("ma2000")
    return Job.model_validate(
        {"url": url, "machine": machine, "limits": machine.limits, "spec": spec, "folder": folder, **more}
    )


@dataclass
class Running:
    """A process under test."""

    process: subprocess.Popen[bytes]

    def reports(self) -> Iterator[Progress | EventHappened | Sampled | Finished | Failed]:
        """What it says, as it comes."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            yield REPORT.validate_json(line)

    def until_event(self, kind: str) -> None:
        """Reads until an event of this kind is told."""
        for report in self.reports():
            assert not isinstance(report, Failed | Finished), report
            if isinstance(report, EventHappened) and report.event.kind == kind:
                return

    def end(self) -> Finished | Failed:
        """The last report."""
        *_, last = self.reports()
        assert isinstance(last, Finished | Failed), last
        return last

    def close_input(self) -> None:
        """As when the parent has gone."""
        assert self.process.stdin is not None
        self.process.stdin.close()

    def exit_code(self) -> int:
        """When it has ended."""
        return self.process.wait(20)


@contextmanager
def running(text: str, *, before: str = "", runtime: Path | None = None) -> Iterator[Running]:
    """A process that is given `text` (a job as JSON); `before` is a shell command that sets its limits."""
    command = [sys.executable, "-m", "daq.acquisition"]
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
        process.stdin.write(text.encode() + b"\n")
        process.stdin.flush()
        yield Running(process)
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            pipe.close()


def text_of(one: Job) -> str:
    """As the parent sends it."""
    return json.dumps(one.model_dump(mode="json"))
