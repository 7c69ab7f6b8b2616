"""Ctrl-C and kill -9 at random moments, of a run and of the service: what is left, lost or told untruly afterwards.

    python -m benchmarks kills [--moments 100] [--seed 1991]
    python -m benchmarks kills --service [--kills 200]

*A run*: each of four ways to end `daq run` or its acquisition process meets that many runs, half of them while they
are recorded, each on a mock of its own in lock-step: the same run gives the same samples to the last bit. Afterwards
nothing may be left running, the port must be free, the arm frozen or at rest, and every sample the undisturbed run's
or the mock's own record of that tick.

*The service*: server, owner of the port and worker are killed in turn while experiments are queued and recorded and a
job runs. The service is brought back, and what it told before is held against what it tells now and against its files.
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
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.figures import Figure, none, show
from benchmarks.mock_process import MockControl, RunningMock, environment_of, is_kept, started_mock
from benchmarks.service_process import COMMAND, ENDS, RunningService, child, ramp, started_service
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
"""The board's tick from which there is a record: in lock-step the move to the start takes a few ticks."""
ACQUISITION, OWNER, WORKER = b"daq.owner", b"server.owner", b"spawn_main"
PORT = "mock://?pty=1&lock_step=1&seed=3"
LENGTHS_S = (1.0, 40.0)
"""Lengths of the service's experiments, in the arm's time."""
LONGEST_MOMENT_S = 1.5
"""Latest time (s) of a kill after the start of an experiment or a job."""
BACK_WITHIN_S = 120.0
QUEUED = 3


@dataclass
class Findings:
    """What was ended, and during what; the faults, one line each."""

    met: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    samples: int = 0
    slowest: float = 0.0
    """Longest time (s) until everything had ended, or was available again."""


# ---- a run


@dataclass(frozen=True)
class Way:
    """One way to end a run. `acquisition`: whether it ends the acquisition process or the command itself."""

    name: str
    number: signal.Signals
    acquisition: bool

    @property
    def freezes(self) -> bool:
        """Whether a process remains that freezes the arm."""
        return not (self.acquisition and self.number is signal.SIGKILL)


WAYS = (
    Way("Ctrl-C of the command", signal.SIGINT, acquisition=False),
    Way("kill -9 of the command", signal.SIGKILL, acquisition=False),
    Way("SIGINT of the acquisition process", signal.SIGINT, acquisition=True),
    Way("kill -9 of the acquisition process", signal.SIGKILL, acquisition=True),
)


@dataclass(frozen=True)
class Undisturbed:
    """An undisturbed run: its trace, and the time in s from the start of each process and of the record."""

    trace: Trace
    command: float
    acquisition: float
    record: float


@dataclass
class Workspace:
    """One run: a mock and a folder of its own."""

    folder: Path
    mock: RunningMock
    control: MockControl

    @property
    def url(self) -> str:
        """URL of the mock's port."""
        return f"{self.mock.url}?lock_step=1"

    def start(self) -> subprocess.Popen[bytes]:
        """Starts `daq run`."""
        quiet = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
        command = [*COMMAND, "--port", self.url, *RUN, "--folder", str(self.folder / "traces")]
        return subprocess.Popen(
            command, cwd=self.folder, env=environment_of(self.folder), start_new_session=True, **quiet
        )

    def once_recording(self) -> None:
        """Waits until the run is far enough on the board that its record is well under way."""
        while self.control.ask("state")["tick"] < RECORDING_FROM:
            time.sleep(0.002)


@contextlib.contextmanager
def workspace() -> Iterator[Workspace]:
    """Yields a fresh workspace."""
    with tempfile.TemporaryDirectory() as name, started_mock(*MOCK) as mock, MockControl(mock.control) as control:
        yield Workspace(Path(name), mock, control)


def undisturbed() -> Undisturbed:
    """Returns the run with which all others are compared. Raises RuntimeError if it fails."""
    with workspace() as here:
        begun = time.monotonic()
        run = here.start()
        until_acquiring(run)
        acquiring = time.monotonic()
        here.once_recording()
        recording = time.monotonic()
        if run.wait(10 * ENDS_WITHIN) != 0:
            raise RuntimeError(f"the undisturbed run ended with {run.returncode}")
        ended = time.monotonic()
        (path,) = (here.folder / "traces").glob("*.mcap")
        return Undisturbed(read_trace(path), ended - begun, ended - acquiring, ended - recording)


def until_acquiring(run: subprocess.Popen[bytes]) -> int:
    """Waits for the acquisition process. Raises RuntimeError if the command ends without one."""
    while True:
        with contextlib.suppress(RuntimeError, OSError):
            return child(run.pid, ACQUISITION)
        if run.poll() is not None:
            raise RuntimeError(f"daq run ended with {run.returncode} before it began")
        time.sleep(0.002)


def end_one(
    way: Way, share: float, whole: Undisturbed, machine: Machine, findings: Findings, *, recording: bool
) -> None:
    """Ends one run after a share (0 to 1) of its time, or of its record's time."""
    label = f"{way.name} at {share:.3f} of the {'record' if recording else 'run'}"
    with workspace() as here:
        run = here.start()
        acquisition = until_acquiring(run) if way.acquisition else None
        if recording:
            here.once_recording()
        length = whole.record if recording else whole.acquisition if way.acquisition else whole.command
        time.sleep(share * length)
        if acquisition is None:
            with contextlib.suppress(RuntimeError, OSError):
                acquisition = child(run.pid, ACQUISITION)
        with contextlib.suppress(ProcessLookupError):
            os.kill(acquisition if way.acquisition and acquisition is not None else run.pid, way.number)
        begun = time.monotonic()
        findings.wrong += [f"{label}: {line}" for line in _left_running(run, acquisition)]
        findings.slowest = max(findings.slowest, time.monotonic() - begun)
        findings.wrong += [f"{label}: {line}" for line in _left_behind(here, way, whole, machine, findings)]


def _left_running(run: subprocess.Popen[bytes], acquisition: int | None) -> list[str]:
    """Returns the processes that remain after ENDS_WITHIN s, and ends them."""
    left, until = [], time.monotonic() + ENDS_WITHIN
    try:
        run.wait(ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        left.append("the command is left running")
        run.kill()
        run.wait()
    while acquisition is not None and _runs(acquisition):
        if time.monotonic() > until:
            os.kill(acquisition, signal.SIGKILL)
            return [*left, "the acquisition process is left running"]
        time.sleep(0.005)
    return left


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def _left_behind(here: Workspace, way: Way, whole: Undisturbed, machine: Machine, findings: Findings) -> list[str]:
    """Returns faults of traces, port and arm. The mock's record is read first: checking the arm overwrites it."""
    kept = {one["tick"]: one for one in here.control.ask("snapshots")["snapshots"]}
    frozen, folder = here.control.ask("state")["frozen"], here.folder / "traces"
    salvaged = salvage_folder(folder) if folder.is_dir() else ()
    wrong = [one.problem for one in salvaged if one.problem and "no trace" not in one.problem]
    outcome, paths = "nothing recorded", sorted(folder.glob("*.mcap"))
    for path in paths:
        try:
            trace = read_trace(path)
        except DaqError as error:
            wrong.append(str(error))
            continue
        outcome = trace.record.outcome or "unknown"
        findings.samples += len(trace)
        if untrue := wrong_samples(trace, whole.trace, kept, machine):
            wrong.append(f"{untrue} of {len(trace)} samples are wrong")
    findings.met[f"{way.name}: {outcome}"] += 1
    if way.freezes and paths and outcome != "complete" and not frozen:
        wrong.append(f"recorded as {outcome}, but the arm is not frozen")
    return [*wrong, *_port_and_arm(here.url)]


def wrong_samples(trace: Trace, whole: Trace, kept: dict[int, dict[str, Any]], machine: Machine) -> int:
    """Returns the number of samples that are neither the undisturbed run's nor the mock's own record of that tick."""
    assert trace.tick is not None
    assert whole.tick is not None
    rows, wrong = {int(tick): row for row, tick in enumerate(whole.tick)}, 0
    for row, tick in enumerate(map(int, trace.tick)):
        if not (tick in rows and _same(trace, row, whole, rows[tick])):
            wrong += not (tick in kept and is_kept(trace, row, kept[tick], machine))
    return wrong


def _same(one: Trace, row: int, other: Trace, there: int) -> bool:
    columns = ((one.set_point, other.set_point), (one.position, other.position), (one.error, other.error))
    return all(a is not None and b is not None and np.array_equal(a[row], b[there]) for a, b in columns)


def _port_and_arm(url: str) -> list[str]:
    try:
        with Controller.connect(url) as controller:
            # The first period after a freeze uses its set points, and the next one shows them.
            first = snapshot = controller.next_snapshot(controller.next_snapshot().tick)
            for _ in range(HOLDS_FOR):
                snapshot = controller.next_snapshot(snapshot.tick)
    except DaqError as error:
        return [f"the port: {error}"]
    moved = [joint for joint, reading in snapshot.joints if reading.set_point != first[joint].set_point]
    off = [joint for joint, reading in snapshot.joints if abs(reading.error) > AT_REST]
    return [f"set points of joints {moved} keep moving"] * bool(moved) + [f"joints {off} do not hold"] * bool(off)


def end_runs(moments: int, seed: int) -> Findings:
    """Ends runs in every way at this many times each."""
    machine, random, findings = load_machine("ma2000"), Random(seed), Findings()
    whole = undisturbed()
    if wrong_samples(undisturbed().trace, whole.trace, {}, machine):
        raise RuntimeError("two undisturbed runs differ: nothing can be compared with them")
    for number in range(moments):
        for way in WAYS:
            end_one(way, random.uniform(0.0, 1.0), whole, machine, findings, recording=bool(number % 2))
    return findings


# ---- the service


class Told:
    """The service's answers at one time, by ID."""

    def __init__(self, service: RunningService) -> None:
        # Waiting ones are requested first and ended ones last: in between, states only advance.
        self.waiting = [one["id"] for one in service.ask("GET", "/queue/experiments")]
        self.running = service.ask("GET", "/queue")["running"]
        self.by_kind: dict[str, dict[str, dict[str, Any]]] = {}
        for kind in ("experiments", "jobs", "traces"):
            found, cursor = self.by_kind.setdefault(kind, {}), {}
            while cursor is not None:
                page = service.ask("GET", f"/{kind}", params={"limit": 200} | cursor)
                found |= {item["id"]: item for item in page["items"]}
                cursor = {"cursor": page["next"]} if page["next"] else None


def untrue(before: Told, after: Told, folder: Path) -> list[str]:
    """Returns statements before a kill that are false after it, or by the files."""
    wrong = []
    for kind, was in before.by_kind.items():
        now = after.by_kind[kind]
        wrong += [f"{kind} {number} is not known any more" for number in was.keys() - now]
        ended = {n: one["state"] for n, one in was.items() if one.get("state") in ENDS}
        wrong += [
            f"{kind} {n} was {ended[n]}, is {now[n]['state']}"
            for n in ended
            if n in now and now[n]["state"] != ended[n]
        ]
    traces = after.by_kind["traces"]
    for number, entry in traces.items():
        try:
            record = read_trace(folder / "traces" / entry["file"]).record
        except DaqError as error:
            wrong.append(str(error))
            continue
        if (record.trace_id, record.outcome) != (number, entry["outcome"]):
            wrong.append(f"{entry['file']} is told to be {number} {entry['outcome']}")
    known = {entry["file"] for entry in traces.values()}
    files = (folder / "traces").glob("*.mcap")
    wrong += [f"{path.name} is not in the catalogue" for path in files if path.name not in known]
    for number, one in after.by_kind["experiments"].items():
        outcome = traces.get(one["trace"] or "", {}).get("outcome")
        # An interrupted one may have reached its end when its process was lost; nobody could know.
        allowed = {"queued": (None,), "done": ("complete",), "interrupted": (None, "interrupted", "complete")}
        if outcome not in allowed.get(one["state"], (outcome,)) or (
            one["state"] == "running" and after.running != number
        ):
            wrong.append(f"experiment {number} is told {one['state']}, its trace {outcome}")
    jobs = [number for number, one in after.by_kind["jobs"].items() if one["state"] == "done"]
    wrong += [f"job {n} has no result" for n in jobs if not (folder / "service/jobs" / n / "result.json").is_file()]
    began = [one for one in before.waiting if one not in after.waiting]
    return wrong + [f"the queue was {before.waiting}, is {after.waiting}"] * (
        [*began, *after.waiting] != before.waiting
    )


def connect(service: RunningService) -> None:
    """Connects; a killed server's acquisition process holds the port until it has closed its trace."""
    give_up = time.monotonic() + BACK_WITHIN_S
    while not (answer := service.robot.post("/connect")).is_success:
        if time.monotonic() > give_up:
            raise RuntimeError(f"not connected within {BACK_WITHIN_S:g} s: {answer.text}")
        time.sleep(0.2)


def kill_service(kills: int, seed: int, folder: Path) -> Findings:
    """Kills server, owner of the port and worker in turn, at random times."""
    random, findings = Random(seed), Findings()
    with contextlib.ExitStack() as open_:
        service = open_.enter_context(started_service(folder, PORT))
        connect(service)
        trace = service.ended("experiments", service.submit(ramp()))["trace"]
        for number in range(kills):
            victim = ("server", "owner", "worker")[number % 3]
            service.reset()
            service.ask("POST", "/queue/resume", json={})
            for _ in range(QUEUED - len(service.ask("GET", "/queue/experiments"))):
                service.submit(ramp(duration=random.uniform(*LENGTHS_S)))
            service.ask("POST", "/jobs", json={"kind": "compare", "traces": [trace], "models": ["machine"]})
            time.sleep(random.uniform(0.0, LONGEST_MOMENT_S))
            before, begun = Told(service), time.monotonic()
            if victim == "server":
                service.kill()
                open_.close()
                service = open_.enter_context(started_service(folder, PORT))
            else:
                with contextlib.suppress(RuntimeError):  # the worker may have nothing to do yet
                    os.kill(child(service.process.pid, OWNER if victim == "owner" else WORKER), signal.SIGKILL)
            connect(service)
            service.ask("POST", "/queue/pause")
            for kind in ("experiments", "jobs"):
                for one in service.ask("GET", f"/{kind}", params={"state": "running"})["items"]:
                    service.ended(kind, one["id"])
            findings.slowest = max(findings.slowest, time.monotonic() - begun)
            findings.met[f"{victim} while {'an experiment' if before.running else 'none'} ran"] += 1
            after = Told(service)
            findings.samples = len(after.by_kind["traces"])
            findings.wrong += [f"kill {number}, {victim}: {line}" for line in untrue(before, after, folder)]
        service.ask("POST", "/disconnect")
    return findings


def main() -> int:
    """Returns the exit code: 1 if there was a fault."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks kills", description=__doc__)
    parser.add_argument("--service", action="store_true", help="kill the service's processes in place of runs")
    parser.add_argument("--moments", type=int, default=100, help="times for each way to end a run")
    parser.add_argument("--kills", type=int, default=200, help="kills of the service's processes")
    parser.add_argument("--seed", type=int, default=1991)
    given = parser.parse_args()
    if given.service:
        with tempfile.TemporaryDirectory() as name:
            findings = kill_service(given.kills, given.seed, Path(name))
    else:
        findings = end_runs(given.moments, given.seed)
    for line in findings.wrong:
        print(f"  {line}", file=sys.stderr)
    met = "; ".join(f"{what} {count}" for what, count in sorted(findings.met.items()))
    figures = [
        Figure("ended", f"{sum(findings.met.values())}", beside=met),
        none("wrong", len(findings.wrong), "left running, port, arm, traces, states"),
        Figure("traces compared with the answers" if given.service else "samples compared", f"{findings.samples}"),
        Figure("everything had ended, or was available again, after at most", f"{findings.slowest:.1f} s"),
    ]
    command = f"python -m benchmarks kills{' --service' * given.service} --seed {given.seed}"
    return show("Ended at random times", command, figures)


if __name__ == "__main__":
    sys.exit(main())
