"""kill -9 of server, worker or acquisition process at random moments: what is lost, what is told untruly afterwards.

    python -m benchmarks service_kills [--database postgresql]

One service with a queue of short experiments and a row of jobs, on a mock in lock-step: what its arm does depends on no
clock, however busy the computer is, and half a minute of an experiment takes a second or two. Again and again one of
its processes is killed at a random moment, sometimes the server once more while it begins; then the service is brought
back, and everything that it told before is held against what it tells now and against the files. The same seed kills
the same processes after the same times; what they are doing then depends on the computer.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.figures import Figure, quantile, show
from benchmarks.service_process import (
    DATABASES,
    ENDS,
    RunningService,
    child,
    database_of,
    dice,
    ramp,
    serving,
    started_service,
)
from daq.contracts.errors import TraceError
from daq.traces.reader import read_trace

VICTIMS = ("server", "acquisition", "worker")
LONGEST_MOMENT_S = 1.5
"""Latest moment (s) of a kill after the start of an experiment or a job."""
WHILE_IT_BEGINS = 0.2
"""Share of the server's kills that are followed by another one before it answers."""
PORT = "mock://?pty=1&lock_step=1&seed=3"
LENGTHS_S = (1.0, 40.0)
"""Lengths of the experiments, in the arm's time."""
WITH_A_JOB = 0.3
"""Share of the other kills that find a job under way."""
QUEUED = 3
BACK_WITHIN_S = 120.0
WORKER, OWNER = b"spawn_main", b"server.owner"


@dataclass
class Told:
    """The service's answers at one moment, by number."""

    experiments: dict[str, dict[str, Any]]
    jobs: dict[str, dict[str, Any]]
    traces: dict[str, dict[str, Any]]
    waiting: list[str]
    queue: dict[str, Any]

    @classmethod
    def by(cls, service: RunningService) -> Told:
        """Everything, page by page."""
        # What waits is asked for first and what has ended last: between the questions things only go on.
        waiting = [one["id"] for one in service.ask("GET", "/queue/experiments")]
        queue = service.ask("GET", "/queue")
        experiments, jobs, traces = (_all(service, f"/{kind}") for kind in ("experiments", "jobs", "traces"))
        return cls(experiments, jobs, traces, waiting, queue)


@dataclass
class Findings:
    """What was checked and what was wrong."""

    kills: Counter[str] = field(default_factory=Counter)
    back: dict[str, list[float]] = field(default_factory=dict)
    """Times (s) until the service had recovered, by the killed process."""
    lost: list[str] = field(default_factory=list)
    untrue: list[str] = field(default_factory=list)
    queue: list[str] = field(default_factory=list)
    finished: set[str] = field(default_factory=set)
    """Traces that were seen finished; each was read."""
    found_running: Counter[str] = field(default_factory=Counter)
    """Kinds and states of what was running at the kills."""


def _all(service: RunningService, path: str) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    cursor: str | None = None
    while True:
        page = service.ask("GET", path, params={"limit": 200} | ({} if cursor is None else {"cursor": cursor}))
        found |= {item["id"]: item for item in page["items"]}
        cursor = page["next"]
        if cursor is None:
            return found


def check(before: Told, after: Told, folder: Path, findings: Findings, label: str) -> None:
    """Holds what was told before a kill against what is told after it, and against the files."""
    _check_traces(before, after, folder, findings, label)
    _check_experiments(before, after, findings, label)
    _check_jobs(before, after, folder, findings, label)
    began = [one for one in before.waiting if one not in after.waiting]
    if [*began, *after.waiting] != before.waiting:
        findings.queue.append(f"{label}: the queue was {before.waiting}, is {after.waiting}")


def _check_traces(before: Told, after: Told, folder: Path, findings: Findings, label: str) -> None:
    findings.lost += [f"{label}: trace {one} is not in the catalogue" for one in before.traces.keys() - after.traces]
    for number, entry in after.traces.items():
        path = folder / "traces" / entry["file"]
        if entry["missing"] or not path.is_file():
            findings.lost.append(f"{label}: the file of trace {number} is not there")
        elif number not in findings.finished:
            findings.finished.add(number)
            try:
                read = read_trace(path)
            except TraceError as error:
                findings.lost.append(f"{label}: {error}")
                continue
            if (read.record.trace_id, read.record.outcome) != (number, entry["outcome"]):
                findings.untrue.append(f"{label}: {path.name} is told to be {number} {entry['outcome']}")
    known = {entry["file"] for entry in after.traces.values()}
    findings.lost += [
        f"{label}: {path.name} is not in the catalogue"
        for path in (folder / "traces").glob("*.mcap")
        if path.name not in known
    ]


def _check_experiments(before: Told, after: Told, findings: Findings, label: str) -> None:
    for number, was in before.experiments.items():
        now = after.experiments.get(number)
        if now is None:
            findings.untrue.append(f"{label}: experiment {number} is not known any more")
        elif was["state"] in ENDS and (now["state"], now["outcome"]) != (was["state"], was["outcome"]):
            findings.untrue.append(f"{label}: experiment {number} was {was['state']}, is {now['state']}")
    for number, now in after.experiments.items():
        trace = after.traces.get(now["trace"] or "")
        outcome = None if trace is None else trace["outcome"]
        wrong = {
            "queued": outcome is not None,
            "running": after.queue["running"] != number,
            "done": outcome != "complete",
            # It had come to its end when its process was lost, or the link; nobody could tell.
            "interrupted": outcome not in (None, "interrupted", "complete"),
        }
        if wrong.get(now["state"], False):
            findings.untrue.append(f"{label}: experiment {number} is told {now['state']}, its trace {outcome}")


def _check_jobs(before: Told, after: Told, folder: Path, findings: Findings, label: str) -> None:
    for number, was in before.jobs.items():
        now = after.jobs.get(number)
        if now is None or (was["state"] in ENDS and now["state"] != was["state"]):
            findings.untrue.append(f"{label}: job {number} was {was['state']}, is {now and now['state']}")
    for number, now in after.jobs.items():
        if now["state"] == "done" and not (folder / "service" / "jobs" / number / "result.json").is_file():
            findings.untrue.append(f"{label}: job {number} is told done and has no result")


class Campaign:
    """The kills, one after the other."""

    def __init__(self, folder: Path, port: str, seed: int) -> None:
        self.folder = folder
        self.findings = Findings()
        self._port = port
        self._random: Random = dice(seed)
        self._open = contextlib.ExitStack()
        self._service: RunningService | None = None
        self._trace = ""

    def run(self, kills: int, seconds: float) -> Findings:
        """All of them, or as many as there is time for."""
        until = time.monotonic() + seconds
        with self._open:
            self._begin()
            self._trace = self._complete_trace()
            for number in range(kills):
                if time.monotonic() > until:
                    break
                self._kill(VICTIMS[number % len(VICTIMS)], f"kill {number}")
            last = Told.by(self._there)
            self._there.ask("POST", "/disconnect")
            self._there.kill()
            self._begin()
            check(last, Told.by(self._there), self.folder, self.findings, "at the end")
            for path in (self.folder / "traces").glob("*.part"):
                self.findings.lost.append(f"{path.name} was not finished")
            self._there.ask("POST", "/disconnect")
        return self.findings

    @property
    def _there(self) -> RunningService:
        assert self._service is not None
        return self._service

    def _kill(self, victim: str, label: str) -> None:
        service, findings = self._there, self.findings
        self._occupy(victim)
        time.sleep(self._random.uniform(0.0, LONGEST_MOMENT_S))
        before = Told.by(service)
        findings.found_running["an experiment"] += before.queue["running"] is not None
        findings.found_running["a job"] += any(one["state"] == "running" for one in before.jobs.values())
        findings.kills[victim] += 1
        begun = time.monotonic()
        if victim == "server":
            service.kill()
            if self._random.random() < WHILE_IT_BEGINS:
                self._kill_while_it_begins()
                findings.kills["server, as it began"] += 1
            self._begin()
            service = self._there
            queue = service.ask("GET", "/queue")
            if queue["queued"] and not (queue["paused"] and "waiting" in queue["reason"]):
                findings.queue.append(f"{label}: after the restart the queue is {queue}")
        else:
            os.kill(child(service.process.pid, OWNER if victim == "acquisition" else WORKER), signal.SIGKILL)
        self._back(victim)
        findings.back.setdefault(victim, []).append(time.monotonic() - begun)
        check(before, Told.by(service), self.folder, findings, f"{label}, {victim}")

    def _complete_trace(self) -> str:
        """A complete trace for the jobs."""
        ended = self._there.ended("experiments", self._there.submit(ramp()))
        if ended["state"] != "done":
            raise RuntimeError(f"the first experiment ended {ended['state']}: {ended['reason']}")
        return str(ended["trace"])

    def _resume(self) -> None:
        self._there.reset()
        self._there.ask("POST", "/queue/resume", json={})

    def _occupy(self, victim: str) -> None:
        """Experiments in the queue, which goes on, and a job where its worker is to be killed."""
        service = self._there
        self._resume()
        for _ in range(QUEUED - len(service.ask("GET", "/queue/experiments"))):
            service.submit(ramp(duration=self._random.uniform(*LENGTHS_S)))
        if victim == "worker" or self._random.random() < WITH_A_JOB:
            job = {"kind": "compare", "traces": [self._trace], "models": ["machine"]}
            number = service.ask("POST", "/jobs", json=job)["id"]
            while service.ask("GET", f"/jobs/{number}")["state"] == "queued":
                time.sleep(0.05)

    def _begin(self) -> None:
        self._open.close()
        self._service = self._open.enter_context(started_service(self.folder, self._port))
        self._connect()

    def _connect(self) -> None:
        """The acquisition process of a killed server has the port until it has closed its trace."""
        give_up = time.monotonic() + BACK_WITHIN_S
        while True:
            answer = self._there.robot.post("/connect")
            if answer.is_success or time.monotonic() > give_up:
                break
            time.sleep(0.2)
        if not answer.is_success:
            raise RuntimeError(f"not connected within {BACK_WITHIN_S:g} s: {answer.text}")

    def _kill_while_it_begins(self) -> None:
        with serving(self.folder, self._port) as process:
            time.sleep(self._random.uniform(0.5, 4.0))
            process.kill()

    def _back(self, victim: str) -> None:
        """Lets no other experiment begin, waits until what ran has ended, and the robot is connected again."""
        service = self._there
        service.ask("POST", "/queue/pause")
        for kind in ("experiments", "jobs"):
            for one in service.ask("GET", f"/{kind}", params={"state": "running"})["items"]:
                service.ended(kind, one["id"])
        if victim == "acquisition":
            self._connect()


def figures_of(found: Findings) -> list[Figure]:
    """The table."""
    total = sum(found.kills.values())
    met = ", ".join(f"{what} ran in {count}" for what, count in found.found_running.items())
    rows = [
        Figure("processes killed", f"{total}", beside=", ".join(f"{who} {n}" for who, n in found.kills.items())),
        Figure(
            "finished traces lost", f"{len(found.lost)}", "0", not found.lost, f"of {len(found.finished)}, all read"
        ),
        Figure("states of experiments and jobs untrue", f"{len(found.untrue)}", "0", not found.untrue, met),
        Figure("queue out of order, or not paused", f"{len(found.queue)}", "0", not found.queue),
    ]
    rows += [
        Figure(f"whole again after the {who}", f"{quantile(times, 0.5):.1f} s", beside=f"longest {max(times):.1f} s")
        for who, times in found.back.items()
    ]
    return rows


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks service_kills", description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=60.0, help="no more kills after so long")
    parser.add_argument("--seed", type=int, default=1991)
    parser.add_argument("--database", choices=DATABASES, default="sqlite")
    parser.add_argument("--quick", action="store_true", help="10 kills")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, database_of(given.database, Path(name)) as database:
        (Path(name) / "daq.toml").write_text(f'[server]\ndatabase = "{database}"\n', "utf-8")
        found = Campaign(Path(name), PORT, given.seed).run(10 if given.quick else given.kills, 60 * given.minutes)
    for line in (*found.lost, *found.untrue, *found.queue):
        print(line, file=sys.stderr)
    return show(f"kill -9 at random moments, {given.database}", "python -m benchmarks service_kills", figures_of(found))


if __name__ == "__main__":
    sys.exit(main())
