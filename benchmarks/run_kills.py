"""Ctrl-C and kill -9 of `daq run` and of its acquisition process at random moments: what is left each time?

    python -m benchmarks run_kills [--moments 100] [--seed 1991]

Each of four ways to end a run meets that many runs, half of them while they are recorded, each on a mock of its own in
lock-step: the same run gives the same samples to the last bit, whatever the computer does. Afterwards nothing may be
left running, the port must be free, the arm must be frozen or hold (frozen where the record had begun, unless the
acquisition process itself was killed), and every trace, salvaged where need be, must be the undisturbed run's up to the
stop; what was recorded after that is held against the mock's own record.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.figures import Figure, show
from benchmarks.mock_control import MockControl
from benchmarks.mock_process import RunningMock, started_mock
from benchmarks.own_environment import environment_of
from benchmarks.service_process import COMMAND, child
from daq.contracts.errors import DaqError
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder

RUN = ("run", "sine", "--joints", "1-3", "--amplitude", "5", "--period", "4", "--cycles", "6", "--hold", "0.2")
MOCK = ("--tcp", "127.0.0.1:0", "--lock-step", "--seed", "3")
ENDS_WITHIN = 30.0
"""Time (s) within which everything must have ended, on a busy computer."""
HOLDS_FOR = 100
"""Number of control periods for which the arm is observed afterwards."""
AT_REST = 40
"""ADC counts of error within which an arm holds."""
RECORDING_FROM = 100
"""The board's tick from which on there is a record: in lock-step the way to the start takes it a few."""
ACQUISITION = b"daq.acquisition"


@dataclass(frozen=True)
class Way:
    """One way to end a run. `acquisition`: whether its acquisition process is met, or the command itself."""

    name: str
    number: signal.Signals
    acquisition: bool

    @property
    def freezes(self) -> bool:
        """Whether a process is left that freezes the arm."""
        return not (self.acquisition and self.number is signal.SIGKILL)


WAYS = (
    Way("Ctrl-C of the command", signal.SIGINT, acquisition=False),
    Way("kill -9 of the command", signal.SIGKILL, acquisition=False),
    Way("SIGINT of the acquisition process", signal.SIGINT, acquisition=True),
    Way("kill -9 of the acquisition process", signal.SIGKILL, acquisition=True),
)


@dataclass
class Findings:
    """What was running at the kills, and what was wrong, one line each in `wrong`."""

    met: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    samples: int = 0
    slowest: float = 0.0
    """Longest time (s) until everything had ended."""


@dataclass(frozen=True)
class Undisturbed:
    """A run that nobody ended: its trace, and the s that it took from the start of each process and of the record."""

    trace: Trace
    command: float
    acquisition: float
    record: float


@dataclass
class Workspace:
    """One run: a mock of its own and a folder of its own."""

    folder: Path
    mock: RunningMock
    control: MockControl

    @property
    def url(self) -> str:
        """URL of the mock's port."""
        return f"{self.mock.url}?lock_step=1"

    def start(self) -> subprocess.Popen[bytes]:
        """`daq run`."""
        return subprocess.Popen(
            [*COMMAND, "--port", self.url, *RUN, "--folder", str(self.folder / "traces")],
            cwd=self.folder,
            env=environment_of(self.folder),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def traces(self) -> list[Path]:
        """All that was finished or salvaged."""
        folder = self.folder / "traces"
        return sorted(folder.glob("*.mcap")) if folder.is_dir() else []


@contextlib.contextmanager
def workspace() -> Iterator[Workspace]:
    """A fresh one."""
    with (
        tempfile.TemporaryDirectory() as name,
        started_mock(*MOCK) as mock,
        MockControl(mock.control) as control,
    ):
        yield Workspace(Path(name), mock, control)


def undisturbed() -> Undisturbed:
    """The run that all others are held against. Raises RuntimeError where it fails."""
    with workspace() as here:
        begun = time.monotonic()
        run = here.start()
        until_acquiring(run)
        acquiring = time.monotonic()
        once_recording(here)
        recording = time.monotonic()
        if run.wait(10 * ENDS_WITHIN) != 0:
            raise RuntimeError(f"the undisturbed run ended with {run.returncode}")
        ended = time.monotonic()
        (path,) = here.traces()
        return Undisturbed(read_trace(path), ended - begun, ended - acquiring, ended - recording)


def until_acquiring(run: subprocess.Popen[bytes]) -> int:
    """The acquisition process, once it is there. Raises RuntimeError when the command ends without one."""
    while True:
        with contextlib.suppress(RuntimeError, OSError):
            return child(run.pid, ACQUISITION)
        if run.poll() is not None:
            raise RuntimeError(f"daq run ended with {run.returncode} before it began")
        time.sleep(0.002)


def after(share: float, way: Way, whole: Undisturbed) -> Callable[[Workspace], None]:
    """Waits for a share (0 to 1) of what the undisturbed run took from the start of the process that is met."""
    return lambda _workspace: time.sleep(share * (whole.acquisition if way.acquisition else whole.command))


def within_the_record(share: float, whole: Undisturbed) -> Callable[[Workspace], None]:
    """Waits until there is a record, and then for a share (0 to 1) of what the undisturbed run took to make it."""

    def wait(here: Workspace) -> None:
        once_recording(here)
        time.sleep(share * whole.record)

    return wait


def once_recording(here: Workspace) -> None:
    """Waits until so much of the run has gone by on the board that its record is well under way."""
    while here.control.ask("state")["tick"] < RECORDING_FROM:
        time.sleep(0.002)


def end_one(
    way: Way, moment: Callable[[Workspace], None], label: str, whole: Undisturbed, machine: Machine, findings: Findings
) -> None:
    """One run, ended when `moment` returns."""
    with workspace() as here:
        run = here.start()
        acquisition = until_acquiring(run) if way.acquisition else None
        moment(here)
        if acquisition is None:
            with contextlib.suppress(RuntimeError, OSError):
                acquisition = child(run.pid, ACQUISITION)
        with contextlib.suppress(ProcessLookupError):
            os.kill(acquisition if way.acquisition and acquisition is not None else run.pid, way.number)
        begun = time.monotonic()
        _until_gone(run, acquisition, label, findings)
        findings.slowest = max(findings.slowest, time.monotonic() - begun)
        _check(here, way, label, whole, machine, findings)


def _until_gone(run: subprocess.Popen[bytes], acquisition: int | None, label: str, findings: Findings) -> None:
    """Waits until nothing of the run is left; what is left after ENDS_WITHIN s is reported and ended."""
    until = time.monotonic() + ENDS_WITHIN
    try:
        run.wait(ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        findings.wrong.append(f"{label}: the command is left running")
        run.kill()
        run.wait()
    while acquisition is not None and _runs(acquisition):
        if time.monotonic() > until:
            findings.wrong.append(f"{label}: the acquisition process is left running")
            os.kill(acquisition, signal.SIGKILL)
            return
        time.sleep(0.005)


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def _check(here: Workspace, way: Way, label: str, whole: Undisturbed, machine: Machine, findings: Findings) -> None:
    """What is left of a run: the mock's record first, which a look at the arm pushes out of its ring."""
    kept = {one["tick"]: one for one in here.control.ask("snapshots")["snapshots"]}
    state = here.control.ask("state")
    for salvaged in salvage_folder(here.folder / "traces") if (here.folder / "traces").is_dir() else ():
        if salvaged.problem and "no trace" not in salvaged.problem:
            findings.wrong.append(f"{label}: {salvaged.problem}")
    paths = here.traces()
    outcome = "nothing recorded"
    for path in paths:
        try:
            trace = read_trace(path)
        except DaqError as error:
            findings.wrong.append(f"{label}: {error}")
            continue
        outcome = trace.record.outcome or "unknown"
        findings.samples += len(trace)
        findings.wrong += [f"{label}: {line}" for line in _wrong(trace, whole.trace, kept, machine)]
    findings.met[f"{way.name}: {outcome}"] += 1
    if way.freezes and paths and outcome != "complete" and not state["frozen"]:
        findings.wrong.append(f"{label}: recorded as {outcome}, and the arm is not frozen")
    findings.wrong += [f"{label}: {line}" for line in _after(here)]


def _wrong(trace: Trace, whole: Trace, kept: dict[int, dict[str, Any]], machine: Machine) -> list[str]:
    """Samples that are neither the undisturbed run's nor the mock's own record of that tick."""
    assert trace.tick is not None
    assert whole.tick is not None
    shift = {int(tick): row for row, tick in enumerate(whole.tick)}
    wrong = 0
    for row, tick in enumerate(map(int, trace.tick)):
        there = shift.get(tick)
        if there is not None and _same(trace, row, whole, there):
            continue
        wrong += not _is_kept(trace, row, kept.get(tick), machine)
    return [f"{wrong} of {len(trace)} samples are wrong"] if wrong else []


def _same(one: Trace, row: int, other: Trace, there: int) -> bool:
    columns = ((one.set_point, other.set_point), (one.position, other.position), (one.error, other.error))
    return all(
        mine is not None and theirs is not None and np.array_equal(mine[row], theirs[there]) for mine, theirs in columns
    )


def _is_kept(trace: Trace, row: int, kept: dict[str, Any] | None, machine: Machine) -> bool:
    assert trace.position is not None
    assert trace.set_point is not None
    if kept is None:
        return False
    for column, joint in enumerate(trace.joints):
        own = machine.calibration(joint)
        here = (
            own.rad_to_posture(float(trace.set_point[row, column])),
            round(own.rad_to_counts(float(trace.position[row, column]))),
        )
        if here != (kept["set_points"][joint - 1], kept["positions"][joint - 1]):
            return False
    return True


def _after(here: Workspace) -> list[str]:
    """What is wrong with the port, or with the arm behind it."""
    try:
        with Controller.connect(here.url) as controller:
            # The first period after a freeze uses its set points, and so it is the next one that they are seen in.
            first = controller.next_snapshot(controller.next_snapshot().tick)
            snapshot = first
            for _ in range(HOLDS_FOR):
                snapshot = controller.next_snapshot(snapshot.tick)
    except DaqError as error:
        return [f"the port: {error}"]
    moved = [joint for joint, reading in snapshot.joints if reading.set_point != first[joint].set_point]
    off = [joint for joint, reading in snapshot.joints if abs(reading.error) > AT_REST]
    return [f"set points of joints {moved} go on moving"] * bool(moved) + [f"joints {off} do not hold"] * bool(off)


def measure(moments: int, seed: int) -> tuple[Findings, dict[str, int]]:
    """Every way at so many moments; how many runs each way ended."""
    machine, random, findings = load_machine("ma2000"), Random(seed), Findings()
    whole = undisturbed()
    again = undisturbed()
    if _wrong(again.trace, whole.trace, {}, machine):
        raise RuntimeError("two undisturbed runs differ: nothing can be held against them")
    ended: Counter[str] = Counter()
    for number in range(moments):
        for way in WAYS:
            share = random.uniform(0.0, 1.0)
            moment = within_the_record(share, whole) if number % 2 else after(share, way, whole)
            of_what = "the record" if number % 2 else "the run"
            end_one(way, moment, f"{way.name} at {share:.3f} of {of_what}", whole, machine, findings)
            ended[way.name] += 1
        print(f"  moment {number + 1} of {moments}: {len(findings.wrong)} wrong", file=sys.stderr, flush=True)
    return findings, dict(ended)


def main() -> int:
    """The exit code: 1 when something was wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks run_kills", description=__doc__)
    parser.add_argument("--moments", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1991)
    parser.add_argument("--quick", action="store_true", help="five moments")
    given = parser.parse_args()
    moments = 5 if given.quick else given.moments
    findings, ended = measure(moments, given.seed)
    for line in findings.wrong:
        print(f"  {line}", file=sys.stderr)
    met = "; ".join(f"{what} {count}" for what, count in sorted(findings.met.items()))
    figures = [
        Figure("runs ended", f"{sum(ended.values())}", beside=met),
        Figure("wrong", f"{len(findings.wrong)}", "0", not findings.wrong, "left running, port, arm, trace, samples"),
        Figure("samples compared", f"{findings.samples}"),
        Figure("everything had ended after, at most", f"{findings.slowest:.1f} s"),
    ]
    command = f"python -m benchmarks run_kills --moments {moments} --seed {given.seed}"
    return show(f"Runs ended at {moments} random moments in each of {len(WAYS)} ways", command, figures)


if __name__ == "__main__":
    sys.exit(main())
