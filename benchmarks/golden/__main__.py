"""Answers held against recorded ones, to the digit: `make golden`.

python -m benchmarks.golden                compare; exit code 1 where anything differs
python -m benchmarks.golden --record       record (of the sources as they are)
python -m benchmarks.golden NAME…          only questions whose name begins so, api, help and trace among them
"""

from __future__ import annotations

import argparse
import json
import lzma
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.golden.answers import Leaf, differences, of_help, of_json
from benchmarks.golden.cases import EXAMPLES, arms, questions
from benchmarks.golden.records import ask, record_all_rigs, record_arm
from daq_cli.app.subcommands import subcommands

PLACE = EXAMPLES.parent / ".golden"
"""Folder of the records between runs; git ignores it."""
KEPT = Path(__file__).parent / "recorded.json.xz"
SHOWN = 12
"""Differences of one answer that are printed."""
Answers = dict[str, dict[str, Leaf]]


def main() -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    kept: Answers = json.loads(lzma.decompress(KEPT.read_bytes())) if KEPT.exists() else {}
    begun, found = time.monotonic(), {}
    with ThreadPoolExecutor(given.processes) as pool:
        record_all_rigs(PLACE)
        (PLACE / "models").mkdir(parents=True, exist_ok=True)
        wanted: list[tuple[str, Callable[[], dict[str, Leaf]]]] = []
        asked = [q for q in questions(PLACE) if _is_wanted(q.name, given.names)]
        needed = " ".join(word for q in asked for word in q.words)
        list(pool.map(lambda arm: record_arm(PLACE, arm), [a for a in arms() if f"/{a.name}/" in needed]))
        print(f"{len(asked)} commands; records are ready after {time.monotonic() - begun:.0f} s", flush=True)
        # A comparison of models needs the fits before it.
        for group in (lambda n: not n.startswith("compare/"), lambda n: n.startswith("compare/")):
            wanted = [(q.name, partial(_asked, q.words)) for q in asked if group(q.name)]
            if group("help"):
                others = (("api", _api), ("help", _help), ("trace", _trace))
                wanted += [(name, answer) for name, answer in others if _is_wanted(name, given.names)]
            for name, answer in zip([n for n, _ in wanted], pool.map(_guarded, [w for _, w in wanted]), strict=True):
                found[name] = answer
                print(_told(name, kept, answer, given.record), flush=True)
    if given.record:
        answers = json.dumps({**kept, **found}, sort_keys=True, indent=0)
        KEPT.write_bytes(lzma.compress(answers.encode(), preset=9))
        values = sum(map(len, found.values()))
        print(f"recorded {len(found)} answers, {values} values, in {time.monotonic() - begun:.0f} s")
        return 0
    wrong = [name for name, answer in found.items() if name not in kept or differences(kept[name], answer)]
    print(
        f"{len(found)} answers compared in {time.monotonic() - begun:.0f} s; different: {len(wrong)} {' '.join(wrong)}"
    )
    return 1 if wrong else 0


def _is_wanted(name: str, beginnings: list[str]) -> bool:
    return not beginnings or any(name.startswith(one) for one in beginnings)


def _guarded(answer: Callable[[], dict[str, Leaf]]) -> dict[str, Leaf]:
    """Returns an answer; a command that fails is an answer too, which differs from the recorded one."""
    try:
        return answer()
    except (RuntimeError, json.JSONDecodeError) as error:
        return {"failed": str(error)}


def _told(name: str, kept: Answers, answer: dict[str, Leaf], recording: bool) -> str:
    failed = f" FAILED: {answer['failed']}" if "failed" in answer else ""
    if recording:
        return f"{name}: {len(answer)} values{failed}"
    if name not in kept:
        return f"{name}: was never recorded{failed}"
    wrong = differences(kept[name], answer)
    if not wrong:
        return f"{name}: the same ({len(kept[name])} values, {len(answer.keys() - kept[name].keys())} new)"
    return "\n  ".join((f"{name}: DIFFERENT in {len(wrong)} of {len(kept[name])}{failed}", *wrong[:SHOWN]))


def _asked(words: tuple[str, ...]) -> dict[str, Leaf]:
    """Returns the answer to a command that prints JSON."""
    return of_json(ask(words))


def _api() -> dict[str, Leaf]:
    """Returns the description of the API."""
    done = subprocess.run([sys.executable, "-m", "server.openapi"], capture_output=True, text=True, check=True)
    return of_json(done.stdout)


def _trace() -> dict[str, Leaf]:
    """Returns every value of a trace that is recorded now, in lock-step."""
    with TemporaryDirectory(prefix="golden-") as folder:
        run = ("--port", "mock://?lock_step=1&seed=7&secret=310", "run", "ramp", "--joints", "1-3", "--yes", "--json")
        trace = json.loads(ask((*run, "--folder", folder)))["trace"]
        file = Path(folder) / "trace.csv"
        ask(("traces", "export", trace, "-o", str(file)))
        rows = file.read_text("utf-8").splitlines()
    return {f"[{number}]": row for number, row in enumerate(rows)}


def _help() -> dict[str, Leaf]:
    """Returns every help page, found by walking the lists of subcommands."""
    pages: dict[str, Leaf] = {}
    waiting: list[tuple[str, ...]] = [()]
    while waiting:
        words = waiting.pop()
        text = "" if words == ("mock",) else ask((*words, "--help"))
        pages |= {f"{' '.join(words)}{path}": word for path, word in of_help(text).items()}
        _, found, below = text.partition("\nCommands:\n")
        lines = [line for line in below.splitlines() if found and line[:3].strip() and line.startswith("  ")]
        names = (
            [line.split()[0] for line in lines] if words else subcommands()
        )  # the first page has headings of its own
        waiting += [(*words, name) for name in names]
    return pages


if __name__ == "__main__":
    sys.exit(main())
