"""What the method in torques says of real machines' records, beside linear least squares.

python -m benchmarks real_records --data FOLDER                every rig
python -m benchmarks real_records --data FOLDER --only emps    one of them

FOLDER holds the data, which are not part of this repository: `emps/DATA_EMPS.mat`, `emps/DATA_EMPS_PULSES.mat`,
`dc/run_minimal.csv`, `double_pendulum/run_01.csv` …, and the folders of KUKA's recorded trajectories in `kuka`
(benchmarks/real_records/sources.py has their sources, commits and licences).
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.figures import Figure, show
from benchmarks.real_records.reference import Reference, reference
from benchmarks.real_records.sources import RIGS, Rig, write_csv

FACTOR = 1000.0
"""A drive that was recorded in V, N or N·m is diagnosed once more in thousandths of it."""


def daq(*words: str) -> dict[str, Any]:
    """The JSON answer of a command of the product."""
    command = [sys.executable, "-c", "from daq_cli import main; main()", *words, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"daq {' '.join(words)}: {done.stderr.strip()}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def names(answer: dict[str, Any]) -> list[str]:
    """The effects of an answer, one text a step: the effect, or the members of a group, whose order says nothing."""
    found = []
    for step in answer["steps"]:
        if step["adopted"]:
            members = sorted(c["effect"] for c in step["group"]) or [step["effect"]]
            joints = "+".join(map(str, step["joints"]))
            found.append(" or ".join(members) + (f" on {joints}" if joints else ""))
    return found


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two answers name the same with the same margins. Sizes in units of the drive are left out."""
    steps = [[s for s in answer["steps"] if s["adopted"]] for answer in (one, other)]
    return names(one) == names(other) and all(
        abs(a["margin"] - b["margin"]) <= 0.01 * max(1.0, abs(a["margin"])) for a, b in zip(*steps, strict=True)
    )


def in_thousandths(machine: Path, out: Path) -> Path | None:
    """The machine file for a drive recorded in thousandths of its unit; None where no plain gain stands in it."""
    text = machine.read_text("utf-8")
    changed = re.sub(r"gain = \{ value = ([-+.\deE]+)", lambda m: f"gain = {{ value = {float(m[1]) / FACTOR!r}", text)
    if 'kind = "dc_motor"' in text:
        return None
    path = out / machine.name
    path.write_text(changed, encoding="utf-8")
    return path


def judge(rig: Rig, data: Path, place: Path) -> list[Figure]:
    """The figures of one rig."""
    written = {n: str(write_csv(rig, data, n, place / "as-recorded")) for n in (*rig.fitted, *rig.held_out)}
    words = [written[n] for n in rig.fitted] + [w for n in rig.held_out for w in ("--holdout", written[n])]
    answer = daq("diagnose", *words, "--model", str(rig.machine), "-o", str(place / "after.json"))
    fit = daq(
        "fit", *words, "--torques", "--model", str(rig.machine), "--effects", rig.effects, "-o", str(place / "fit.json")
    )
    cutoff = next(n["values"]["cutoff"] for n in answer["notes_data"] if n["kind"] == "cutoff")
    left = next(n["values"] for n in answer["notes_data"] if n["kind"] == "torque-left")
    columns = [[rig.read(data / rig.folder, n) for n in group] for group in (rig.fitted, rig.held_out)]
    linear, linear_fit = (
        reference(rig.machine, columns[0], columns[1], at, constant=rig.constant, springs=rig.springs)
        for at in (cutoff, fit["cutoff"])
    )
    print(f"\n{rig.name}: {rig.origin}\n  {answer['verdict']}: {'; '.join(names(answer))}\n  {answer['summary']}")
    found = [*_named(rig, answer), *_shares(left, fit, linear, linear_fit), *_errors(answer, linear)]
    machine = in_thousandths(rig.machine, place)
    if machine is not None:
        again = {n: str(write_csv(rig, data, n, place / "thousandths", FACTOR)) for n in written}
        files = [again[n] for n in rig.fitted] + [w for n in rig.held_out for w in ("--holdout", again[n])]
        other = daq("diagnose", *files, "--model", str(machine))
        found.append(Figure("the same names and margins in a unit 1000 times smaller", "", "yes", same(answer, other)))
    return [Figure(f"{rig.name}: {f.name}", f.value, f.target, f.met, f.beside) for f in found]


def _named(rig: Rig, answer: dict[str, Any]) -> list[Figure]:
    said = names(answer)
    hit = all(any(name in text for name in one for text in said) for one in rig.expected)
    wanted = ", ".join(" or ".join(one) for one in rig.expected)
    return [Figure("named", "; ".join(said) or answer["verdict"], wanted, hit)]


def _shares(left: dict[str, Any], fit: dict[str, Any], linear: Reference, linear_fit: Reference) -> list[Figure]:
    """Torque left on held-out records beside that of the linear fit."""
    return [
        Figure(
            f"torque left, held out, {what}",
            f"{value:.1%}",
            "≤ beside",
            value <= one.held_out,
            f"{one.held_out:.1%}, linear fit with {one.columns} columns; on its own records {one.fitted:.1%}",
        )
        for what, value, one in (
            ("diagnosis", left["after"], linear),
            ("daq fit --torques", fit["held_out"], linear_fit),
        )
    ]


def _errors(answer: dict[str, Any], linear: Reference) -> list[Figure]:
    return [
        Figure(
            f"joint {e['joint']}, held out, where it moves",
            f"{e['before']:.3g} → {e['after']:.3g} {e['unit']}",
            beside=f"linear fit {linear.rms[k]:.3g} {e['unit']}, also where it rests; noise {e['floor']:.2g}",
        )
        for k, e in enumerate(answer["rmse_holdout"])
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Prints the figures of every rig; 1 where a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--only", choices=[rig.name for rig in RIGS], action="append")
    options = parser.parse_args(arguments)
    figures: list[Figure] = []
    for rig in RIGS:
        if options.only and rig.name not in options.only:
            continue
        with TemporaryDirectory() as place:
            figures += judge(rig, options.data, Path(place))
    return show("Real records", "real_records", figures)


if __name__ == "__main__":
    sys.exit(main())
