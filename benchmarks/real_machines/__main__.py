"""What a diagnosis answers on real machines' records, beside what is known of them and beside least squares.

python -m benchmarks real_machines --data FOLDER                 every rig as it is, and with its honest alteration
python -m benchmarks real_machines --data FOLDER --only emps     one of them (may be repeated)
python -m benchmarks real_machines --list                        which repositories FOLDER has to hold
python -m benchmarks real_machines --data FOLDER --rigs benchmarks/real_machines/reporting.toml   the reporting set
python -m benchmarks real_machines --data FOLDER --least-squares  least squares alone, without any diagnosis

FOLDER holds checkouts or bare copies of the public repositories, as `name`, `owner/name` or `owner+name`. Nothing of
them is part of this repository. Exit code 1 where a question has no right answer or least squares leaves less.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.figures import machine
from benchmarks.real_machines.judge import judge, moved, wrong_names
from benchmarks.real_machines.records import (
    MissingDataError,
    add_torque,
    machine_data,
    read_columns,
    write_machine,
    write_record,
)
from benchmarks.real_machines.reference import gain_of, reference
from benchmarks.real_machines.rigs import HERE, Alteration, Question, Rig, load_rigs

LONGEST = 400.0
"""Most CPU seconds of a diagnosis; after them it has no answer."""
CUTOFF = 12.0
"""Cutoff of the reference in Hz if no answer states one: the largest of the product."""


@dataclass(frozen=True)
class Row:
    """One line of the table. left, reference: shares of the held-out torque, None if no torque was recorded."""

    rig: str
    question: str
    known: str
    answered: str
    mark: str
    wrong: str
    left: float | None
    reference: float | None
    seconds: float


@dataclass(frozen=True)
class Run:
    """Output of a diagnosis, or why there is none; CPU seconds of the whole command."""

    answer: dict[str, Any] | None
    reason: str
    seconds: float


def diagnose(fitted: Sequence[Path], held_out: Sequence[Path], model: Path, place: Path, longest: float) -> Run:
    """Runs `daq diagnose --json` with default options, in a separate process that ends after `longest` CPU seconds."""
    words = [*map(str, fitted), *(w for path in held_out for w in ("--holdout", str(path))), "--model", str(model)]
    limited = ["sh", "-c", f'ulimit -t {longest:.0f}; exec "$@"', "sh"]
    command = [*limited, sys.executable, "-c", "from daq_cli import main; main()", "diagnose", *words, "--json"]
    with (place / "answer").open("wb+") as out, (place / "errors").open("wb+") as errors:
        process = subprocess.Popen(command, stdout=out, stderr=errors, cwd=place)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = usage.ru_utime + usage.ru_stime
    if (answered := (place / "answer").read_bytes()).strip():  # doubts about the records end with another code
        return Run(json.loads(answered), "", seconds)
    said = (place / "errors").read_text("utf-8", errors="replace").strip().splitlines()
    late = process.returncode in (-signal.SIGXCPU, -signal.SIGKILL) and seconds > 0.9 * longest
    return Run(None, f"no answer in {longest:.0f} CPU s" if late else f"error: {(said or ['?'])[-1]}", seconds)


def rows(rig: Rig, alteration: Alteration | None, data: Path, longest: float, keep: Path | None) -> list[Row]:
    """Returns the lines of one rig, unchanged or altered. keep: a folder for the JSON of the answer."""
    questions = (alteration.question,) if alteration else rig.questions
    right = {*rig.plausible, *(name for each in (*rig.questions, *questions) for name in each.names)}
    title = f"{rig.name}: {alteration.what}" if alteration else rig.name
    with TemporaryDirectory() as folder:
        place = Path(folder)
        changed = (alteration.set, alteration.remove) if alteration else ({}, ())
        model = write_machine(rig.machine, *changed, place / "machine.toml")
        drives = [joint["drive"] for joint in machine_data(rig.machine)["joints"]]
        records = [read_columns(rig, record, data) for record in (*rig.fitted, *rig.held_out)]
        if alteration and alteration.add:
            torque = alteration.add
            records = [add_torque(columns, torque, gain_of(drives[torque.joint - 1])) for columns in records]
        files = [write_record(each, place / f"record_{k}.csv", rig.drive_unit) for k, each in enumerate(records, 1)]
        first = len(rig.fitted)
        run = diagnose(files[:first], files[first:], model, place, longest)
        linear = None
        if "drive_1" in records[0]:
            cutoff = min(CUTOFF, _note(run.answer, "cutoff").get("cutoff") or CUTOFF)
            linear = reference(model, records[:first], records[first:], cutoff, offset=rig.offset).held_out
    if keep is not None and run.answer is not None:
        (keep / f"{rig.name}{'-altered' if alteration else ''}.json").write_text(json.dumps(run.answer), "utf-8")
    return [_row(title, question, run, right, linear) for question in questions]


def least_squares(rig: Rig, data: Path) -> str:
    """Returns one line: the torque that a linear fit leaves on fitted and on held-out records."""
    records = [read_columns(rig, record, data) for record in (*rig.fitted, *rig.held_out)]
    seconds = sum(float(columns["time"][-1] - columns["time"][0]) for columns in records)
    said = f"{rig.name:<16} {rig.joints} joints, {len(records)} records, {seconds:.0f} s"
    if "drive_1" not in records[0]:
        return f"{said}: no torque is recorded"
    first = len(rig.fitted)
    found = reference(rig.machine, records[:first], records[first:], CUTOFF, offset=rig.offset)
    return f"{said}: {found.fitted:.1%} of the fitted, {found.held_out:.1%} of the held-out torque remains"


def _row(title: str, question: Question, run: Run, right: set[str], linear: float | None) -> Row:
    if run.answer is None:
        return Row(title, question.what, question.known, run.reason, "none", "", None, linear, run.seconds)
    answered, mark = judge(question, run.answer, right)
    if mark in ("honest", "wrong") and (told := moved(question, _note(run.answer, "stated-numbers-moved"))):
        answered, mark = f"{answered}; a warning: {told}", "half"
    wrong = "; ".join(wrong_names(run.answer, right))
    left = _note(run.answer, "torque-left").get("after")
    return Row(title, question.what, question.known, answered, mark, wrong, left, linear, run.seconds)


def _note(answer: dict[str, Any] | None, kind: str) -> dict[str, Any]:
    """Returns the values of the first note of a kind; empty without one."""
    notes = answer["notes_data"] if answer else []
    return next((note["values"] for note in notes if note["kind"] == kind), {})


def table(found: Sequence[Row]) -> str:
    """Returns the lines as a table in Markdown."""

    def share(value: float | None) -> str:
        return "–" if value is None else f"{value:.1%}"

    head = ("rig", "question", "known", "answered", "mark", "wrong names", "torque left", "least squares", "CPU s")
    lines = [head, ("---",) * len(head)]
    for r in found:
        given = (r.rig, r.question, r.known, r.answered, r.mark, r.wrong)
        lines.append((*given, share(r.left), share(r.reference), f"{r.seconds:.0f}"))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def summary(found: Sequence[Row]) -> str:
    """Returns marks of unchanged and of altered rigs, runs with wrong names, and comparisons of remaining torque."""
    said = []
    for what, some in (
        ("as they are", [r for r in found if ":" not in r.rig]),
        ("altered", [r for r in found if ":" in r.rig]),
    ):
        marks = Counter(r.mark for r in some)
        runs = {r.rig: r for r in some}
        wrong = sum(bool(r.wrong) for r in runs.values())
        both = [r for r in runs.values() if r.left is not None and r.reference is not None]
        less = sum(r.left <= r.reference for r in both)  # type: ignore[operator]
        shown = ", ".join(f"{marks[mark]} {mark}" for mark in ("right", "half", "honest", "wrong", "none"))
        said.append(
            f"{what}: of {len(some)} questions {shown}; wrong names in {wrong} of {len(runs)} runs; "
            f"no more torque left than by least squares in {less} of {len(both)}"
        )
    return "\n".join(said)


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the table; returns 1 if an answer is not right or least squares leaves less, 2 without data."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--rigs", type=Path, default=HERE / "rigs.toml", help="another list of rigs")
    parser.add_argument("--only", action="append", metavar="NAME")
    parser.add_argument("--least-squares", action="store_true", help="only print the least-squares results")
    parser.add_argument("--as-they-are", action="store_true", help="without the alterations")
    parser.add_argument("--longest", type=float, default=LONGEST, help="most CPU seconds of a diagnosis")
    parser.add_argument("--keep", type=Path, help="folder for the answers' JSON and the rows")
    parser.add_argument("--list", action="store_true", help="list the repositories")
    options = parser.parse_args(arguments)
    rigs = {rig.name: rig for rig in load_rigs(options.rigs)}
    if unknown := set(options.only or ()) - set(rigs):
        parser.error(f"--only {unknown.pop()}: not known; available: {', '.join(rigs)}")
    chosen = [rigs[name] for name in options.only or rigs]
    if options.list or options.data is None:
        for rig in chosen:
            print(f"{rig.name:<16} github.com/{rig.repository} at {rig.commit[:8]}  {rig.title}  ({rig.licence})")
        return 0 if options.list else parser.error("--data is needed")
    if options.least_squares:
        for rig in chosen:
            print(least_squares(rig, options.data), flush=True)
        return 0
    found = list[Row]()
    if options.keep is not None:
        options.keep.mkdir(parents=True, exist_ok=True)
    for rig in chosen:
        for alteration in (None,) if options.as_they_are else (None, rig.alteration):
            try:
                new = rows(rig, alteration, options.data, options.longest, options.keep)
            except MissingDataError as error:
                print(error, file=sys.stderr)
                return 2
            found += new
            print(f"{new[0].rig}: {new[0].answered}, {new[0].seconds:.0f} CPU s", file=sys.stderr, flush=True)
            if options.keep is not None:
                with (options.keep / "rows.jsonl").open("a", encoding="utf-8") as file:
                    file.writelines(json.dumps(asdict(row)) + "\n" for row in new)
    print(f"\n{table(found)}\n\n{summary(found)}\n[{machine()}]")
    good = all(r.mark == "right" and (r.left is None or r.reference is None or r.left <= r.reference) for r in found)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
