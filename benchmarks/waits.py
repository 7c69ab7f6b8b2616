"""What a user waits for, by the clock: a start, a first set point, a page of 10⁵ traces; and the memory of hours.

python -m benchmarks waits                     all of it (3 minutes)
python -m benchmarks waits --only start list   some parts: start, list, memory
"""

from __future__ import annotations

import argparse
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
from sqlalchemy import insert, text

from benchmarks.figures import Figure, at_most, quantile, show
from benchmarks.mock_process import environment_of
from benchmarks.service_process import COMMAND, ENDS, ROBOT, child, started_service, sway
from daq.traces.reader import read_trace
from server.store.engine import Store
from server.store.tables import TraceRow, TraceTagRow

TRACES = 100_000
FIRST = datetime(2024, 1, 1, tzinfo=UTC)
RARE = "brass bush replaced"
WORDS = ("belt", "loose", "after", "service", "warm", "cold", "payload", "motor", "noise", "wear", "morning", "check")
LIBRARIES, MOCK = "import fastapi, numpy, sqlalchemy.orm, uvicorn", "import mock_controller.device"
QUIET = "[server]\nconnect_at_start = false\n"


def waited(act: Callable[[], float | None], times: int) -> tuple[float, str]:
    """The median time (s) of an act, which may measure itself; and the least and the most, in words."""
    found = []
    for _ in range(times):
        begun = time.monotonic()
        own = act()
        found.append(time.monotonic() - begun if own is None else own)
    return quantile(found, 0.5), f"{min(found):.2f} to {max(found):.2f} s, {times} times"


def python(program: str) -> None:
    """Runs a Python program."""
    subprocess.run([sys.executable, "-c", program], check=True)


def until_driven() -> float:
    """Time (s) from the start of `daq run ramp` to its first set point, after which the arm rests for 0.5 s."""
    with tempfile.TemporaryDirectory() as name:
        command, begun = [*COMMAND, "--port", "mock://", "run", "ramp"], time.time()
        subprocess.run(command, cwd=name, env=environment_of(Path(name)), capture_output=True, check=True)
        (path,) = Path(name).rglob("*.mcap")
        return read_trace(path).record.created.timestamp() - begun


def served() -> float:
    """Time (s) from the start of `daq serve` to its first answer. No robot is connected."""
    with tempfile.TemporaryDirectory() as name:
        Path(name, "daq.toml").write_text(QUIET, "utf-8")
        begun = time.monotonic()
        with started_service(Path(name), "mock://") as service:
            httpx.get(f"{service.url}/healthz").raise_for_status()
            return time.monotonic() - begun


def start(times: int) -> Iterator[Figure]:
    """Starting, beside a Python that only imports what the programs load."""
    libraries, mock = waited(lambda: python(LIBRARIES), times)[0], waited(lambda: python(MOCK), times)[0]
    answer, spread = waited(served, times)
    yield at_most("daq serve to its first answer", answer, 1.0, "s", f"{spread}; its libraries {libraries:.2f} s")
    driven, spread = waited(until_driven, times)
    yield at_most("daq run ramp to its first set point", driven, 0.6, "s", f"{spread}; the mock's imports {mock:.2f} s")


def fill(folder: Path, count: int) -> None:
    """A database and a folder of traces as `daq serve` finds them: ten kinds, forty tags, notes in words."""
    dice, store = random.Random(count), Store(folder / "service" / "service.sqlite")
    usual: dict[str, object] = {
        "robot": ROBOT,
        "source": "real",
        "name": "study",
        "joints": [1, 2, 3],
        "moved": " 1 2 3 ",
    }
    usual |= {"outcome": "complete", "samples": 1500, "duration": 30.0, "size": 900_000, "missing": False}
    rows, tags, at = [], [], FIRST
    for number in range(count):
        at += timedelta(seconds=dice.uniform(30, 900))
        identity, kind, tag = f"{dice.getrandbits(48):012x}", f"kind {number % 10}", f"week {dice.randrange(40)}"
        notes = RARE if number % 9973 == 0 else " ".join(dice.choices(WORDS, k=6))
        own = {"id": identity, "file": f"{identity}.mcap", "created": at, "kind": kind, "notes": notes}
        rows.append(usual | own | {"searched": f"{identity}\n{kind}\n{notes}\n{tag}"})
        tags.append({"trace": identity, "tag": tag, "created": at})
    store.migrate()
    with store.writing() as session:
        session.execute(insert(TraceRow), rows)
        session.execute(insert(TraceTagRow), tags)
        session.execute(text("ANALYZE"))
    store.close()
    (folder / "traces").mkdir()
    for row in rows:  # the service compares both when it starts
        (folder / "traces" / str(row["file"])).touch()
    (folder / "daq.toml").write_text(QUIET, "utf-8")


def asked(count: int, times: int) -> dict[str, float]:
    """Times (ms, p99) of pages of a list over REST, one question after the other."""
    questions = {
        "newest": {},
        "from the middle": {"until": (FIRST + timedelta(seconds=232 * count)).isoformat()},
        "one kind": {"kind": "kind 3"},
        "one tag": {"tag": "week 7"},
        "a word that many have": {"q": WORDS[0]},
        "words that few have": {"q": RARE},
    }
    taken: dict[str, list[float]] = {what: [] for what in questions}
    with tempfile.TemporaryDirectory() as name:
        fill(Path(name), count)
        with started_service(Path(name), "mock://") as service:
            for what, question in [*questions.items()] * times:
                begun = time.perf_counter()
                service.ask("GET", "/traces", params={"limit": 50, **question})
                taken[what].append(1e3 * (time.perf_counter() - begun))
    return {what: quantile(each, 0.99) for what, each in taken.items()}


def lists(times: int) -> Iterator[Figure]:
    """Pages of a long list; beside them, those of a list of a hundredth."""
    few = asked(TRACES // 100, times)
    for what, took in asked(TRACES, times).items():
        yield at_most(f"list of {TRACES} traces, {what}, p99", took, 10.0, "ms", f"of a hundredth {few[what]:.1f} ms")


def resident(process: int) -> float:
    """Memory (bytes) of a process."""
    status = Path(f"/proc/{process}/status").read_text("utf-8")
    return 1024.0 * int(status.partition("VmRSS:")[2].split()[0])


def memory(hours: int) -> Iterator[Figure]:
    """What service and owner gain while records of an hour are made in lock-step, after the first of them."""
    with tempfile.TemporaryDirectory() as name, started_service(Path(name), "mock://?lock_step=1") as service:
        service.ask("POST", "/connect")
        numbers = [service.submit(sway(3600.0)) for _ in range(hours)]
        service.until_recording(numbers[0])
        programs = {"service": service.process.pid, "owner": child(service.process.pid, b"server.owner")}
        each, begun = [], time.monotonic()
        for number in numbers:
            while (found := service.ask("GET", f"/experiments/{number}", params={"wait": 1}))["state"] not in ENDS:
                now = {what: resident(process) / 2**20 for what, process in programs.items()}
            each.append(now)
        told = f"{found['state']}, {3600.0 * hours / (time.monotonic() - begun):.0f} times real time"
    for what in programs:
        beside = f"MB after each: {' '.join(f'{size[what]:.0f}' for size in each)}; {told}"
        gained = 100 * (each[-1][what] / each[0][what] - 1)
        yield at_most(f"memory gained by the {what} in {hours} hours", gained, 2.0, "%", beside)


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks waits", description=__doc__)
    parser.add_argument("--times", type=int, default=9, help="repeats of each start; ten times as many questions")
    parser.add_argument("--hours", type=int, default=2, help="records of an hour whose memory is measured")
    parser.add_argument("--only", nargs="+", choices=("start", "list", "memory"), default=("start", "list", "memory"))
    given = parser.parse_args()
    parts = {"start": start(given.times), "list": lists(10 * given.times), "memory": memory(given.hours)}
    figures = [figure for part in given.only for figure in parts[part]]
    return show("What a user waits for", "python -m benchmarks waits", figures)


if __name__ == "__main__":
    sys.exit(main())
