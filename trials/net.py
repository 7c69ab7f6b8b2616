"""Compares test rigs of used-up kinds with their recorded verdicts: a part of `make net`.

    python -m trials.net                compare; exit code 1 if a verdict, a name or a joint differs
    python -m trials.net --record all   record the answers of the present sources (missing: only missing ones)

The table `expected.csv` lists the rigs: up to five of each combination of joints, drive and controller with up to three
joints. Among them are single effects, pairs, healthy arms, and effects that are in no library. Five of each of the
seventy kinds would take an hour. The rigs stay in `.golden/rigs` between runs.
"""

from __future__ import annotations

import argparse
import csv
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic

from trials.judge import Json, diagnose
from trials.rigs.folder import write_rig

TABLE = Path(__file__).with_name("expected.csv")
RIGS = Path(__file__).parents[1] / ".golden" / "rigs"
Row = dict[str, str]


def main() -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m trials.net", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--record", choices=("all", "missing"))
    parser.add_argument("--processes", type=int, default=2)
    asked = parser.parse_args()
    begun = monotonic()
    with TABLE.open(encoding="utf-8", newline="") as file:
        expected = list(csv.DictReader(file))
    chosen = [
        n for n, row in enumerate(expected) if asked.record == "all" or bool(row["verdict"]) != bool(asked.record)
    ]
    found, different = list(expected), 0
    with ThreadPoolExecutor(asked.processes) as pool:
        for n, row in zip(chosen, pool.map(_answered, [expected[n] for n in chosen]), strict=True):
            if asked.record and row["verdict"] == "failed":  # perhaps too late on a busy computer: no answer to keep
                print(f"{_told(row)}: not recorded", flush=True)
                continue
            found[n] = row
            if row != expected[n]:
                different += 1
                print(f"{_told(expected[n])}\n  now {_told(row)}", flush=True)
            if asked.record:
                _write(found)
    print(f"{len(chosen)} rigs answered in {monotonic() - begun:.0f} s; different: {different}")
    missing = sum(not row["verdict"] for row in found)
    if missing:
        print(f"{missing} rigs have no recorded answer: python -m trials.net --record missing")
    return 1 if different and not asked.record else 0


def _write(rows: list[Row]) -> None:
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _answered(row: Row) -> Row:
    """Returns the row of a rig with the present answer of the diagnosis."""
    place = RIGS / f"{row['kind']}-{row['seed']}-{row['case']}"
    if not (place / "truth.json").exists():
        write_rig(place, row["kind"], int(row["seed"]), row["case"])
    answer = diagnose(place / "lab")
    return row | {"verdict": answer["verdict"] if answer else "failed", "effects": _effects(answer)}


def _effects(answer: Json | None) -> str:
    """Returns each adopted step: the effect or group of effects that it names, and its joints."""
    adopted = [step for step in (answer or {}).get("steps", []) if step["adopted"]]
    return "; ".join(
        f"{' | '.join(sorted({step['effect'], *(each['effect'] for each in step['group'])}))} {step['joints']}"
        for step in adopted
    )


def _told(row: Row) -> str:
    return f"{row['kind']} {row['seed']} ({row['case']}): {row['verdict']}: {row['effects']}"


if __name__ == "__main__":
    sys.exit(main())
