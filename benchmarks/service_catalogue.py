"""A catalogue of 100 000 traces: how long its list, its pages and its search take over REST.

    python -m benchmarks service_catalogue [--database postgresql] [--traces 1000000]

The table is filled with made-up rows in the shape of years of a lab's work: ten kinds, forty tags, notes in words; the
folder has an empty file for each, since the service compares both when it starts. Then one client asks, one question
after the other. The floor is the same questions to the same service with one trace in a hundred.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import insert, text

from benchmarks.figures import Figure, at_most, quantile, show
from benchmarks.service_process import DATABASES, ROBOT, RunningService, database_of, dice, started_service
from server.store.engine import Store
from server.store.stretches import note_terms
from server.store.tables import TraceRow, TraceTagRow

TARGET_MS = 50.0
START = datetime(2024, 1, 1, tzinfo=UTC)
KINDS = ("ramp", "cubic", "step", "staircase", "sine", "multisine", "slow_ramp", "pause", "path", "sequence")
OUTCOMES = (*["complete"] * 97, "stopped", "fault", "interrupted")
WORDS = [
    "belt",
    "loose",
    "after",
    "service",
    "warm",
    "cold",
    "payload",
    "new",
    "motor",
    "joint",
    "elbow",
    "noise",
    "wear",
    "morning",
    "repeat",
    "check",
    "gripper",
    "open",
    "bearing",
    "slack",
]
TAGS = tuple(f"week {number}" for number in range(40))
RARE = "brass bush replaced"
FIRST, LAST = "night shift", "workshop"
"""Operators of the oldest and of the newest traces alone: a list that is read from its newest trace on finds the one
late, an index that is read in the order of writing the other."""
SPAN = 0.05
"""Share of the traces that each of them recorded."""
BATCH = 5000


def rows(count: int, random_: random.Random) -> Iterator[dict[str, Any]]:
    """Rows of the table, the oldest first."""
    moment = START
    for number in range(count):
        moment += timedelta(seconds=random_.uniform(30, 900))
        identity, kind = f"{random_.getrandbits(48):012x}", random_.choice(KINDS)
        file = f"{moment:%Y%m%dT%H%M%SZ}_{ROBOT}_{kind}_{identity}.mcap"
        notes = RARE if number % 9973 == 0 else " ".join(random_.choices(WORDS, k=6))
        outcome = random_.choice(OUTCOMES)
        operator = FIRST if number < SPAN * count else LAST if number >= (1 - SPAN) * count else "anna"
        yield {
            "id": identity,
            "robot": ROBOT,
            "file": file,
            "created": moment,
            "source": "real",
            "kind": kind,
            "name": f"study {number % 300}",
            "joints": [1, 2, 3],
            "outcome": outcome,
            "samples": 1500,
            "duration": 30.0,
            "size": 900_000,
            "operator": operator,
            "experiment": None,
            "notes": notes,
            "searched": "\n".join((identity, file, f"study {number % 300}", kind, operator, notes, outcome)).lower(),
            "missing": False,
        }


def fill(folder: Path, database: str, count: int) -> None:
    """A database, and a folder of traces, as `daq serve` finds them in `folder`."""
    random_ = dice(count)
    (folder / "traces").mkdir()
    store = Store(database)
    store.migrate()
    made = list(rows(count, random_))
    for first in range(0, count, BATCH):
        part = made[first : first + BATCH]
        tags = [{"trace": row["id"], "tag": random_.choice(TAGS), "created": row["created"]} for row in part]
        for row, tag in zip(part, tags, strict=True):
            row["searched"] += f"\n{tag['tag']}"
        with store.writing() as session:
            session.execute(insert(TraceRow), part)
            session.execute(insert(TraceTagRow), tags)
            note_terms(session, ROBOT, ((row["created"], row["searched"]) for row in part))
        for row in part:
            (folder / "traces" / row["file"]).touch()
    with store.engine.execution_options(isolation_level="AUTOCOMMIT").connect() as connection:
        connection.execute(text("ANALYZE"))  # PostgreSQL does this by itself, some time later
    store.close()


def listed(service: RunningService, times: int) -> list[float]:
    """Times (ms) of pages of the list, following it from the newest trace on, and beginning anew at random moments."""
    random_, found, cursor = dice(1), [], None
    for number in range(times):
        query: dict[str, Any] = {"limit": 50} | ({} if cursor is None else {"cursor": cursor})
        if number % 10 == 0:
            query = {"limit": 50, "until": (START + timedelta(hours=random_.uniform(1, 12000))).isoformat()}
        took, page = _timed(service, query)
        found.append(took)
        cursor = page["next"]
    return found


def searched(service: RunningService, times: int, count: int) -> dict[str, list[float]]:
    """Times (ms) of searches among so many traces, by what they look for."""
    random_ = dice(2)
    kinds: dict[str, list[float]] = {}
    for _ in range(times):
        questions: dict[str, dict[str, Any]] = {
            "a word that many have": {"q": random_.choice(WORDS)},
            "words that few have": {"q": RARE},
            "what nothing has": {"q": f"{random_.getrandbits(40):x} nowhere"},
            "the oldest traces alone": {"q": FIRST},
            "the newest alone, from further back": {"q": LAST, "until": _somewhere(random_, count)},
            "one letter": {"q": random_.choice(("a", "7", "_", "ß"))},
            "two letters": {"q": random_.choice(("be", "72", "st"))},
            "two letters, from further back": {"q": random_.choice(("be", "72")), "until": _somewhere(random_, count)},
            "two letters that nothing has": {"q": random_.choice(("qx", "jq", "€%"))},
            "two letters that few have": {"q": "bu"},
            "two letters of the oldest alone": {"q": "gh", "until": _somewhere(random_, count)},
            "two letters and a kind": {"q": "be", "kind": random_.choice(KINDS)},
            "two letters and a tag": {"q": "72", "tag": random_.choice(TAGS)},
            "two letters of runs that failed": {"q": "72", "outcome": "fault"},
            "a kind that nothing has": {"kind": "nothing"},
            "one tag": {"tag": random_.choice(TAGS)},
            "one kind": {"kind": random_.choice(KINDS)},
            "runs that failed": {"outcome": random_.choice(("fault", "interrupted"))},
            "a week": {"since": START.isoformat(), "until": (START + timedelta(days=7)).isoformat(), "q": "belt"},
            "a tag, a kind and a word": {"tag": TAGS[3], "kind": "sine", "q": "loose"},
        }
        for name, question in questions.items():
            kinds.setdefault(name, []).append(_timed(service, question | {"limit": 50})[0])
    return kinds


def _somewhere(random_: random.Random, count: int) -> str:
    """A time in the middle of the list, whose traces are 465 s apart on average."""
    return (START + timedelta(seconds=465 * count * random_.uniform(0.1, 0.9))).isoformat()


def _timed(service: RunningService, query: dict[str, Any]) -> tuple[float, dict[str, Any]]:
    begun = time.perf_counter()
    page = service.ask("GET", "/traces", params=query)
    return 1e3 * (time.perf_counter() - begun), page


def measure(kind: str, count: int, times: int) -> tuple[list[float], dict[str, list[float]], float]:
    """List, searches (ms), and the start of the service (s) with so many traces."""
    with tempfile.TemporaryDirectory() as name, database_of(kind, Path(name)) as database:
        folder = Path(name)
        fill(folder, database, count)
        lines = ("[server]", "connect_at_start = false", f'database = "{database}"', "")
        (folder / "daq.toml").write_text("\n".join(lines), "utf-8")
        begun = time.perf_counter()
        with started_service(folder, "mock://") as service:
            start = time.perf_counter() - begun
            return listed(service, 10 * times), searched(service, times, count), start


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks service_catalogue", description=__doc__)
    parser.add_argument("--traces", type=int, default=100_000)
    parser.add_argument("--times", type=int, default=40, help="how often each question is asked")
    parser.add_argument("--database", choices=DATABASES, default="sqlite")
    parser.add_argument("--quick", action="store_true", help="each question 10 times")
    given = parser.parse_args()
    times = 10 if given.quick else given.times
    pages, searches, start = measure(given.database, given.traces, times)
    few_pages, few_searches, few_start = measure(given.database, max(1, given.traces // 100), times)
    every, few_every = ([one for each in kinds.values() for one in each] for kinds in (searches, few_searches))

    def beside(many: list[float], few: list[float]) -> str:
        return f"p50 {quantile(many, 0.5):.1f}, max {max(many):.1f} ms; of a hundredth p99 {quantile(few, 0.99):.1f} ms"

    figures = [
        at_most("list, p99", quantile(pages, 0.99), TARGET_MS, "ms", beside(pages, few_pages)),
        at_most("search, p99", quantile(every, 0.99), TARGET_MS, "ms", beside(every, few_every)),
    ]
    figures += [
        Figure(f"  {name}, p99", f"{quantile(took, 0.99):.3g} ms", beside=beside(took, few_searches[name]))
        for name, took in searches.items()
    ]
    figures.append(Figure("start of the service", f"{start:.1f} s", beside=f"of a hundredth {few_start:.1f} s"))
    return show(
        f"{given.traces} traces in the catalogue, {given.database}", "python -m benchmarks service_catalogue", figures
    )


if __name__ == "__main__":
    sys.exit(main())
