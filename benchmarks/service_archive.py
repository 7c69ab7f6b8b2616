"""The archive on a store of another project's: its speed, its cost for experiments, and what is lost when all fails.

    python -m benchmarks service_archive

First traces of two megabytes are sent and fetched. Then one experiment runs while nothing else happens, one while
traces are sent and dropped, and one while the store stalls; a client asks for lists meanwhile. At last the store fails
in every way at random moments, and the service is killed with -9 at others, while traces are made, dropped, fetched and
deleted. Then every trace is fetched, and held against the bytes that were recorded.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import httpx

from benchmarks.figures import Figure, at_most, quantile, show
from benchmarks.service_process import RunningService, dice, started_service, sway
from daq.traces.csv_table import import_csv
from daq.traces.naming import trace_path
from daq.traces.store import write_trace
from tests.server.archive.store import ACCESS, SECRET, Fault, FaultyStore, ObjectStore, faulty, running_store

PORT = "mock://?pty=1&seed=3"
ROWS = 9000
"""Samples of a made-up trace of six joints: about two megabytes."""
LIST_TARGET_MS = 50.0
LONGEST_MOMENT_S = 1.0


def configure(folder: Path, bucket: str, url: str, *more: str) -> None:
    """A service's configuration, with the key in a file."""
    (folder / "key.toml").write_text(f'access_key = "{ACCESS}"\nsecret_key = "{SECRET}"\n', "utf-8")
    archive = (f'bucket = "{bucket}"', f'endpoint = "{url}"', f'credentials = "{folder / "key.toml"}"', *more)
    lines = ("[server]", "connect_at_start = false", "[archive]", *archive, "")
    (folder / "daq.toml").write_text("\n".join(lines), "utf-8")


def make_trace(folder: Path, seed: int, rows: int = ROWS) -> Path:
    """A trace of six joints with values that do not compress well."""
    random_ = dice(seed)
    table = folder / "made.csv"
    head = ",".join(["time", *(f"position_{joint}" for joint in range(1, 7))])
    lines = (
        ",".join([f"{0.02 * row:.2f}", *(f"{random_.uniform(-1, 1):.6f}" for _ in range(6))]) for row in range(rows)
    )
    table.write_text("\n".join([head, *lines]), "utf-8")
    trace = import_csv(table)
    (folder / "traces").mkdir(exist_ok=True)
    path = trace_path(folder / "traces", trace.record)
    write_trace(trace, path)
    return path


def place(service: RunningService, trace: str) -> dict[str, Any]:
    """Where a trace is."""
    found: dict[str, Any] = service.ask("GET", f"/traces/{trace}/archive")
    return found


def until(service: RunningService, trace: str, name: str, value: bool) -> float:
    """Waits until a trace is archived, or local; the time (s)."""
    begun = time.monotonic()
    while bool(place(service, trace)[name]) is not value:
        time.sleep(0.005)
    return time.monotonic() - begun


@dataclass
class Speed:
    """Times (s) of traces of `size` bytes on their way."""

    sent: list[float] = field(default_factory=list)
    fetched: list[float] = field(default_factory=list)
    size: int = 0


def speed(store: ObjectStore, count: int) -> Speed:
    """Sends traces, reads them back, drops and fetches them."""
    found = Speed()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        configure(folder, store.bucket(), store.url)
        files = [make_trace(folder, seed) for seed in range(count)]
        found.size = sum(file.stat().st_size for file in files) // count
        for file in files:
            file.rename(folder / file.name)
        with started_service(folder, PORT) as service:
            for file in files:
                body = (folder / file.name).read_bytes()
                headers = {"Content-Type": "application/octet-stream"}
                trace = service.ask("POST", "/traces", content=body, headers=headers)["id"]
                found.sent.append(until(service, trace, "archived", True))
                service.ask("POST", f"/traces/{trace}/archive", json={"drop": True})
                until(service, trace, "local", False)
                service.ask("POST", f"/traces/{trace}/fetch")
                found.fetched.append(until(service, trace, "local", True))
    return found


@dataclass
class Run:
    """One experiment, and a client's questions meanwhile. `late` is the share of samples that came more than 20 ms
    later than the quickest."""

    missing: int
    late: float
    asked: list[float]


def one_run(service: RunningService, seconds: float) -> Run:
    """Runs an experiment."""
    before = _lateness(service)
    number = service.submit(sway(seconds))
    asked: list[float] = []
    ends = threading.Event()

    def ask() -> None:
        with httpx.Client(base_url=service.robot.base_url, timeout=60) as client:
            while not ends.wait(0.02):
                begun = time.perf_counter()
                client.get("/traces", params={"limit": 50}).raise_for_status()
                asked.append(1e3 * (time.perf_counter() - begun))

    asking = threading.Thread(target=ask)
    asking.start()
    ended = service.ended("experiments", number)
    ends.set()
    asking.join()
    if ended["state"] != "done":
        raise RuntimeError(f"the experiment ended {ended['state']}: {ended['reason']}")
    details = service.ask("GET", f"/traces/{ended['trace']}")
    after = _lateness(service)
    every = after["+Inf"] - before["+Inf"]
    return Run(details["missing_samples"], 1 - (after["0.02"] - before["0.02"]) / max(1.0, every), asked)


def _lateness(service: RunningService) -> dict[str, float]:
    """The histogram of the samples' delay, by its upper bounds."""
    text = httpx.get(str(service.robot.base_url).partition("/api")[0] + "/metrics", timeout=60).text
    lines = [line for line in text.splitlines() if line.startswith("daq_sample_lateness_seconds_bucket")]
    return {line.partition('le="')[2].partition('"')[0]: float(line.rpartition(" ")[2]) for line in lines}


def beside_experiments(store: ObjectStore, seconds: float, traces: int) -> dict[str, Run]:
    """Experiments without and with work for the archive, and with a store that stalls."""
    found: dict[str, Run] = {}
    with tempfile.TemporaryDirectory() as name, faulty(store) as proxy:
        folder = Path(name)
        configure(folder, store.bucket(), proxy.url, "timeout = 2", "keep_size = 1", "keep_used = false")
        with started_service(folder, PORT) as service:
            service.ask("POST", "/connect")
            service.ask("POST", "/queue/resume", json={})
            found["nothing else"] = one_run(service, seconds)
            headers = {"Content-Type": "application/octet-stream"}
            bodies = [make_trace(folder, 100 + number).read_bytes() for number in range(2 * traces)]
            for path in (folder / "traces").glob("*.mcap"):
                if "import" in path.name:
                    path.unlink()
            for what, fault in (("traces are sent and dropped", ""), ("the store stalls", "stall")):
                proxy.fail(fault)  # type: ignore[arg-type]
                for body in (bodies.pop() for _ in range(traces)):
                    service.robot.post("/traces", content=body, headers=headers)
                found[what] = one_run(service, seconds)
            proxy.go_on.set()
            service.ask("POST", "/disconnect")
    return found


@dataclass
class Findings:
    """What the campaign did and found."""

    kills: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    orders: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    traces: int = 0
    back: list[float] = field(default_factory=list)
    """Times (s) until everything was sent after the last failure."""


class Campaign:
    """Random orders, faults and kills."""

    def __init__(self, folder: Path, store: ObjectStore, proxy: FaultyStore, seed: int) -> None:
        self._folder, self._store, self._proxy = folder, store, proxy
        self._random = dice(seed)
        self._bucket = store.bucket()
        configure(folder, self._bucket, proxy.url, "timeout = 0.5")
        self._made: dict[str, str] = {}
        """SHA-256 of every trace that was not deleted."""
        self.found = Findings()

    def run(self, kills: int) -> Findings:
        """Kills the service so often."""
        for _ in range(kills):
            with started_service(self._folder, PORT) as service:
                self._proxy.go_on.clear()
                for _ in range(4):
                    self._fail()
                    self._order(service)
                    time.sleep(self._random.uniform(0, LONGEST_MOMENT_S / 4))
                service.kill()
                self._proxy.go_on.set()
            self.found.kills += 1
        self._proxy.fail("")
        with started_service(self._folder, PORT) as service:
            self._check(service)
        return self.found

    def _fail(self) -> None:
        fault: Fault = self._random.choice(("", "", *(one for one in get_args(Fault) if one)))
        self.found.faults[fault or "none"] += 1
        self._proxy.fail(fault)

    def _order(self, service: RunningService) -> None:
        what = self._random.choice(("make", "make", "drop", "drop", "fetch", "delete"))
        trace = self._random.choice(sorted(self._made)) if self._made else ""
        if what != "make" and not trace:
            what = "make"
        self.found.orders[what] += 1
        if what == "make":
            path = make_trace(self._folder, 1000 + self.found.traces, 200)  # content that no earlier one had
            body = path.read_bytes()
            path.unlink()
            headers = {"Content-Type": "application/octet-stream"}
            made = service.ask("POST", "/traces", content=body, headers=headers)
            self._made[made["id"]] = hashlib.sha256(body).hexdigest()
            self.found.traces += 1
        elif what == "drop":
            service.ask("POST", f"/traces/{trace}/archive", json={"drop": True})
        elif what == "fetch":
            service.ask("POST", f"/traces/{trace}/fetch")
        elif service.robot.delete(f"/traces/{trace}").is_success:
            del self._made[trace]

    def _check(self, service: RunningService) -> None:
        begun = time.monotonic()
        while (status := service.ask("GET", "/archive"))["waiting"] or status["state"] != "ok":
            time.sleep(0.05)
        self.found.back.append(time.monotonic() - begun)
        listed: dict[str, Any] = {}
        cursor: str | None = None
        while cursor is not None or not listed:
            page = service.ask("GET", "/traces", params={"limit": 500} | ({"cursor": cursor} if cursor else {}))
            listed |= {one["id"]: one for one in page["items"]}
            cursor = page["next"]
            if cursor is None:
                break
        self.found.wrong += [f"trace {one} is not listed" for one in self._made.keys() - listed]
        self.found.wrong += [f"trace {one} was deleted" for one in listed.keys() - self._made]
        for trace, digest in self._made.items():
            service.ask("POST", f"/traces/{trace}/fetch")
            until(service, trace, "local", True)
            content = service.robot.get(f"/traces/{trace}/data.mcap").content
            found = place(service, trace)
            if hashlib.sha256(content).hexdigest() != digest:
                self.found.wrong.append(f"trace {trace} is another one: {json.dumps(found)}")
            if found["sha256"] != digest:
                self.found.wrong.append(f"trace {trace} is archived as another one: {json.dumps(found)}")
        objects = self._store.objects(self._bucket)
        kept = {hashlib.sha256(content).hexdigest() for content in objects.values()}
        self.found.wrong += [
            f"trace {one} is not in the bucket" for one, sum_ in self._made.items() if sum_ not in kept
        ]
        log = (self._folder / "service.log").read_text("utf-8", errors="replace")
        self.found.wrong += [f"the log has a secret: {one}" for one in (ACCESS, SECRET) if one in log]


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks service_archive", description=__doc__)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1991)
    parser.add_argument("--quick", action="store_true", help="8 kills, short experiments")
    given = parser.parse_args()
    kills, seconds, traces = (8, 4.0, 5) if given.quick else (given.kills, 20.0, 30)
    with running_store() as store:
        times = speed(store, 5 if given.quick else 20)
        runs = beside_experiments(store, seconds, traces)
        with _folder() as folder, faulty(store) as proxy:
            found = Campaign(folder, store, proxy, given.seed).run(kills)
    for line in found.wrong:
        print(line, file=sys.stderr)
    size = f"{times.size / 1e6:.2f} MB"
    figures = [
        Figure(
            f"sent and read back, {size}, p50",
            f"{1e3 * quantile(times.sent, 0.5):.0f} ms",
            beside=f"longest {1e3 * max(times.sent):.0f} ms",
        ),
        Figure(
            f"fetched, {size}, p50",
            f"{1e3 * quantile(times.fetched, 0.5):.0f} ms",
            beside=f"longest {1e3 * max(times.fetched):.0f} ms",
        ),
    ]
    for what, run in runs.items():
        figures.append(
            Figure(f"samples lost, {what}", f"{run.missing}", "0", run.missing == 0, f"{run.late:.1%} over 20 ms late")
        )
        figures.append(at_most("  lists meanwhile, p99", quantile(run.asked, 0.99), LIST_TARGET_MS, "ms"))
    faults = ", ".join(f"{name} {count}" for name, count in sorted(found.faults.items()))
    figures.append(Figure("service killed with -9", f"{found.kills}", beside=f"store: {faults}"))
    orders = ", ".join(f"{name} {count}" for name, count in sorted(found.orders.items()))
    wrong = len(found.wrong)
    figures.append(Figure("traces lost, changed, or told untruly", f"{wrong}", "0", not wrong, f"orders: {orders}"))
    figures.append(Figure("everything sent after the last failure", f"{max(found.back):.1f} s"))
    return show("The archive, on moto's server", "python -m benchmarks service_archive", figures)


if __name__ == "__main__":
    sys.exit(main())
