"""Runs a registered trial on test rigs that tuning never saw, and prints the rates of `daq diagnose` beside their
targets.

    python -m trials.registered --hashes                                                      # for a registration
    python -m trials.registered --registration docs/trial/worlds-16.toml --folder FOLDER --seconds 500
    python -m trials.registered --folder FOLDER --sharpness --seconds 500
    python -m trials.registered --table FILE.csv

Repeat the second until there are enough arms: each call continues where the last one stopped. Two of them run at the
same time if `--only` gives each its kinds. Seeds are drawn from the commit that registered the file. Cases take turns,
and the kind on which the least time was spent comes next. The third computes from the truth which effects a healthy arm
can imitate, and which can imitate the effects that were named in their place. Every arm is a line of FOLDER/cases.csv;
the last prints the table of such lines. docs/trial.md has the rules.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from hashlib import sha256
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from daq.contracts.documents import parse_toml, read_text
from model.discrepancy.diagnosis import Diagnosis
from model.trial.score import excess_removed_whole
from trials.blind.registered import REGISTERED, library_versions, registering_commit, tree_hashes
from trials.blind.registration import RegisteredCode
from trials.blind.table import rate
from trials.judge import QUESTIONS, TOLD_APART, covered, diagnose, names_of, score
from trials.rigs.folder import write_rig
from trials.rigs.kinds import KINDS
from trials.rigs.recorded_rig import hidden_rig

DECIDES = (*REGISTERED, "daq_cli", "trials/rigs", "trials/judge.py", "trials/registered.py")
"""Parts of the source tree that determine the outcome."""
FIRST_DRAWN = 10**6
"""Smallest seed that a commit draws; smaller ones are for tuning and tests."""
TO_REACH = {
    "strict": "≥ 85 %",
    "sharp": "≥ 95 %",
    "both": "≥ 88 %",
    "honest": "≥ 92 %",
    "alarm": "≤ 1 %",
}
LEAST_CASES = {"strict": 200, "sharp": 200, "alarm": 200, "both": 60}
"""Number of arms below which a rate counts as having too few."""


DETECTABLE = "the same without those of which d′ is known to be below 5"
"""Second line of a question, for effects that a record shows."""


class RigsRegistration(RegisteredCode):
    """Arms of several kinds of test rig. `cases` take turns; an answer that takes more than `longest` s counts as
    none."""

    kinds: tuple[str, ...]
    cases: tuple[str, ...]
    longest: float

    def seed(self, commit: str, kind: str, number: int) -> int:
        """Returns the seed of an arm, drawn from the commit that registered it."""
        return FIRST_DRAWN + int(sha256(f"{commit} {kind} {number}".encode()).hexdigest()[:12], 16)


@dataclass(frozen=True)
class Row:
    """An arm, its answer, and the score; None for questions that do not apply."""

    kind: str
    number: int
    seed: int
    case: str
    hidden: str
    verdict: str
    answered: str
    strict: bool | None
    in_answer: bool | None
    joints: bool | None
    both: bool | None
    honest: bool | None
    alarm: bool | None
    d_prime: float | None
    """Between the arm with and without its effect, the least of several; None if not computed."""
    sharp: bool | None
    """None if a given name was not compared with the effect, or if the healthy arm can imitate it."""
    excess_removed: float | None
    seconds: float
    intervals: int = 0
    """Intervals of the effect's sizes that can be compared (`intervals`), for a single effect that was named."""
    covering: int = 0
    """Number of them that cover the truth."""

    @property
    def resolved(self) -> bool:
        """Whether it is known if the answer was as sharp as the record allows, or that the effect is not detectable."""
        return self.sharp is not None or (self.d_prime is not None and self.d_prime < TOLD_APART)


def place_of(folder: Path, kind: str, number: int) -> Path:
    return folder / f"{kind}-{number}"


def make_arm(place: Path, kind: str, seed: int, case: str, longest: float) -> None:
    """Writes a rig's folder and runs the diagnosis. A rig whose loop is unstable with its effect gets neither."""
    begun = monotonic()
    kept: dict[str, Any] = {"kind": kind, "seed": seed, "case": case, "late": False, "answer": None, "seconds": 0.0}
    try:
        write_rig(place, kind, seed, case)
    except ValueError as error:
        kept |= {"void": str(error)}
        place.mkdir(parents=True, exist_ok=True)
    else:
        asked = monotonic()
        kept["answer"] = diagnose(place / "lab", longest)
        kept["seconds"] = monotonic() - asked
        kept["late"] = kept["answer"] is None and kept["seconds"] >= longest
    kept["spent"] = monotonic() - begun
    (place / "answer.json").write_text(json.dumps(kept), "utf-8")


def kept_in(folder: Path, kind: str, number: int) -> dict[str, Any] | None:
    """Returns the data in an arm's folder; None if the arm has not been completed."""
    file = place_of(folder, kind, number) / "answer.json"
    if not file.exists():
        return None
    found: dict[str, Any] = json.loads(file.read_text("utf-8"))
    return found


def numbers(folder: Path, kind: str) -> list[int]:
    """Returns numbers of a kind's completed arms, from 0 on without a gap."""
    found = 0
    while kept_in(folder, kind, found) is not None:
        found += 1
    return list(range(found))


def run(registration: RigsRegistration, commit: str, folder: Path, seconds: float, only: Collection[str] = ()) -> None:
    """Runs arm after arm, first the kind on which the least time was spent, and begins none after `seconds`.

    `only` are the kinds of this process, if another one runs the rest at the same time.
    """
    end = monotonic() + seconds
    kinds = [kind for kind in registration.kinds if not only or kind in only]
    done = {kind: len(numbers(folder, kind)) for kind in kinds}
    spent = {kind: sum((kept_in(folder, kind, n) or {})["spent"] for n in range(count)) for kind, count in done.items()}
    while monotonic() < end:
        kind = min(kinds, key=lambda kind: spent[kind])
        number = done[kind]
        case = registration.cases[number % len(registration.cases)]
        make_arm(
            place_of(folder, kind, number), kind, registration.seed(commit, kind, number), case, registration.longest
        )
        kept = kept_in(folder, kind, number) or {}
        done[kind], spent[kind] = number + 1, spent[kind] + kept["spent"]
        made = row_of(folder, kind, number)
        said = f"{made.hidden or made.case} -> {made.verdict}: {made.answered}" if made else kept["void"]
        print(f"{kind} {number}: {said} ({kept['seconds']:.0f} of {kept['spent']:.0f} s)", flush=True)


def row_of(folder: Path, kind: str, number: int) -> Row | None:
    """Returns an arm's row; None if its loop is unstable with its effect."""
    kept = kept_in(folder, kind, number)
    if kept is None or "void" in kept:
        return None
    truth, answer = json.loads((place_of(folder, kind, number) / "truth.json").read_text("utf-8")), kept["answer"]
    worth = score(truth, answer)
    names = [" | ".join(sorted(names)) for names in names_of(answer or {"steps": []})]
    inside = covered(truth, answer)
    alone = [rival["d_prime"] for rival in truth.get("sharpness", []) if rival["name"] == "none"]
    return Row(
        *(kind, number, kept["seed"], kept["case"]),
        hidden="; ".join(f"{one['name']} {one['joint'] or ''}".strip() for one in truth["hidden"]),
        verdict=answer["verdict"] if answer else ("late" if kept["late"] else "failed"),
        answered="; ".join(names),
        strict=worth.strict,
        in_answer=worth.answered,
        joints=worth.joints,
        both=worth.both,
        honest=worth.honest,
        alarm=None if kept["late"] else worth.alarm,
        d_prime=min(truth.get("detectability", alone), default=None),
        sharp=worth.sharp,
        excess_removed=excess_removed_whole(Diagnosis.model_validate(answer)) if answer else None,
        seconds=kept["seconds"],
        intervals=len(inside),
        covering=sum(inside),
    )


def add_sharpness(folder: Path, seconds: float, only: Collection[str] = ()) -> None:
    """Adds d′ to hidden effects: against the arm without them, and for single ones against the named rivals.

    `only` are the kinds of this process, if another one computes the rest at the same time.
    """
    from trials.rigs.sharpness import detectability, sharpness

    end = monotonic() + seconds
    for kind in [kind for kind in KINDS if not only or kind in only]:
        for row in filter(None, (row_of(folder, kind, number) for number in numbers(folder, kind))):
            if row.case == "sound" or (row.d_prime is not None and (row.resolved or row.case != "single")):
                continue
            if monotonic() > end:
                return
            rig = hidden_rig(kind, row.seed, row.case)
            if row.case != "single":
                found = detectability(rig)
                _add(place_of(folder, kind, row.number), {"detectability": found})
                print(f"{kind} {row.number}: d′ {', '.join(f'{one:.1f}' for one in found)}", flush=True)
                continue
            answer = (kept_in(folder, kind, row.number) or {})["answer"]
            named = () if row.strict or answer is None else sorted(set().union(*names_of(answer)))
            rivals = sharpness(rig, named)
            _add(place_of(folder, kind, row.number), {"sharpness": [asdict(rival) for rival in rivals]})
            others = [f"{rival.name} {rival.d_prime:.1f}" for rival in rivals[2:]]
            print(f"{kind} {row.number}: d′ {rivals[0].d_prime:.1f}; {', '.join(others)}", flush=True)


def _add(place: Path, found: dict[str, Any]) -> None:
    """Adds to the truth in an arm's folder."""
    file = place / "truth.json"
    truth = json.loads(file.read_text("utf-8")) | found
    file.write_text(json.dumps(truth, indent=1, ensure_ascii=False) + "\n", "utf-8")


def rows_of(folder: Path) -> list[Row]:
    """Returns the rows of all completed arms, and writes them to cases.csv."""
    found = [row for kind in KINDS for n in numbers(folder, kind) if (row := row_of(folder, kind, n)) is not None]
    with (folder / "cases.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Row)])
        table.writeheader()
        table.writerows({key: _text(value) for key, value in asdict(row).items()} for row in found)
    return found


def _text(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(int(value) if isinstance(value, bool) else value)


def read_rows(file: Path) -> list[Row]:
    """Reads rows that were written."""
    with file.open(newline="", encoding="utf-8") as lines:
        return [Row(**{name: _value(name, text) for name, text in line.items()}) for line in csv.DictReader(lines)]


def _value(name: str, text: str) -> Any:
    if name in ("strict", "in_answer", "joints", "both", "honest", "alarm", "sharp"):
        return bool(int(text)) if text else None
    if name in ("d_prime", "excess_removed", "seconds"):
        return float(text) if text else None
    return int(text) if name in ("number", "seed", "intervals", "covering") else text


def table(rows: Sequence[Row]) -> list[str]:
    """Returns the table as Markdown: each rate with its exact 95 % interval, in total and by kind of rig."""
    kinds = list(dict.fromkeys(row.kind for row in rows))
    seen = [row for row in rows if row.d_prime is None or row.d_prime >= TOLD_APART]
    lines = [f"| what | to reach | all | {' | '.join(kinds)} |", "|" + "---|" * (len(kinds) + 3)]

    def line(words: str, reach: str, question: str, of: Iterable[Row]) -> None:
        some = list(of)
        cells = [rate(getattr(row, question) for row in some if row.kind == kind) for kind in kinds]
        whole = rate(getattr(row, question) for row in some)
        few = " (too few)" if whole.cases < LEAST_CASES.get(question, 0) else ""
        parts = " | ".join(f"{cell.hits}/{cell.cases}" if cell.cases else "–" for cell in cells)
        lines.append(f"| {words} | {reach} | {whole}{few} | {parts} |")

    line("named right, strict, of all single effects", TO_REACH["strict"], "strict", rows)
    line(DETECTABLE, TO_REACH["strict"], "strict", seen)
    open_ = sum(row.case == "single" and (row.d_prime is None or not row.resolved) for row in rows)
    line(f"as sharp as the record allows ({open_} not worked out)", TO_REACH["sharp"], "sharp", rows)
    line("right one among what is named", "", "in_answer", rows)
    line("joint right, where the right one is named", "", "joints", rows)
    line("false alarm on sound arms", TO_REACH["alarm"], "alarm", rows)
    line(QUESTIONS["both"], TO_REACH["both"], "both", rows)
    line(DETECTABLE, TO_REACH["both"], "both", seen)
    line(QUESTIONS["honest"], TO_REACH["honest"], "honest", rows)
    line(DETECTABLE, TO_REACH["honest"], "honest", seen)
    inside = {kind: [row for row in rows if row.kind == kind and row.intervals] for kind in kinds}
    if any(inside.values()):
        counts = [(sum(r.covering for r in some), sum(r.intervals for r in some)) for some in inside.values()]
        whole = rate(hit for hits, of in counts for hit in (*[True] * hits, *[False] * (of - hits)))
        cells = " | ".join(f"{hits}/{of}" if of else "–" for hits, of in counts)
        lines.append(f"| intervals of named single effects that cover the truth | 92–98 % | {whole} | {cells} |")
    late = {kind: sum(row.verdict == "late" for row in rows if row.kind == kind) for kind in kinds}
    lines.append(f"| no answer in the time | | {sum(late.values())} | {' | '.join(map(str, late.values()))} |")
    medians = [f"{np.median([row.seconds for row in rows if row.kind == kind]):.0f}" for kind in kinds]
    times = np.percentile([row.seconds for row in rows], (50, 95))
    lines.append(
        f"| whole command, s: median, 95th percentile | | {times[0]:.0f}, {times[1]:.0f} | {' | '.join(medians)} |"
    )
    removed = [row.excess_removed for row in rows if row.case == "single" and row.excess_removed is not None]
    if removed:
        low, middle = np.percentile(removed, (10, 50))
        words = f"{100 * middle:.1f}, {100 * low:.1f} % of {len(removed)}"
        lines.append(
            f"| held-out excess removed from single effects: median, 10th percentile | ≥ 98, ≥ 90 % | {words} |"
            + " |" * len(kinds)
        )
    return lines


def main() -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m trials.registered", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--registration", type=Path)
    parser.add_argument("--folder", type=Path, help="keeps the rigs and answers")
    parser.add_argument("--seconds", type=float, default=500.0, help="no arm is begun after this time")
    parser.add_argument("--only", nargs="+", default=(), metavar="KIND", help="the kinds of this process, of several")
    parser.add_argument(
        "--sharpness", action="store_true", help="add d′ against the healthy arm and against wrong names"
    )
    parser.add_argument("--table", type=Path, help="print the table of these lines, and run nothing")
    parser.add_argument("--hashes", action="store_true", help="print the code's hashes for a registration")
    asked = parser.parse_args()
    if asked.hashes:
        hashed = [f'"{path}" = "{digest}"' for path, digest in tree_hashes(DECIDES).items()]
        versions = [f'{name} = "{found}"' for name, found in library_versions().items()]
        print("\n".join(["[hashes]", *hashed, "", "[versions]", *versions]))
        return 0
    if asked.table is not None:
        if not asked.table.is_file():
            parser.error(f"--table {asked.table}: there is no such file")
        print("\n".join(table(read_rows(asked.table))))
        return 0
    if asked.folder is None or (asked.registration is None) == (not asked.sharpness):
        parser.error("--folder with --registration or --sharpness; or --table; or --hashes")
    if unknown := set(asked.only) - set(KINDS):
        parser.error(f"--only {', '.join(sorted(unknown))}: no such kind; see `python -m trials.rigs --list`")
    if asked.sharpness:
        add_sharpness(asked.folder, asked.seconds, asked.only)
    else:
        registration = RigsRegistration.model_validate(
            parse_toml(read_text(asked.registration, str(asked.registration)), str(asked.registration))
        )
        if unknown := set(asked.only) - set(registration.kinds):
            parser.error(f"--only {', '.join(sorted(unknown))}: allowed is {', '.join(registration.kinds)}")
        registration.check_code(tree_hashes(DECIDES), library_versions(), str(asked.registration))
        run(registration, registering_commit(asked.registration), asked.folder, asked.seconds, asked.only)
    print("\n" + "\n".join(table(rows_of(asked.folder))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
