"""Judges answers of `daq diagnose` on test rigs that share no code with it: names, joints and false alarms by kind of
rig.

    python -m trials.judge --kinds tuning --seeds 0-4 [--case single] [--sharpness] [--folder FOLDER]

`python -m trials.rigs` writes the rigs; the diagnosis is the command, and sees only their `lab` folders. Answers stay
in the folder, and an interrupted call continues where it stopped. Kinds of REPORTING are for registered trials. They
need `--reporting`, since a kind that was looked at can no longer be used to report.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from time import monotonic
from typing import Any

from trials.rigs.folder import write_rig
from trials.rigs.kinds import KINDS, REPORTING, TUNING
from trials.rigs.recorded_rig import CASES, case_of

Json = dict[str, Any]

LONGEST = 900.0
"""Most time of a diagnosis, s; a longer one gives no answer."""
HONEST = ("unknown-effect", "suspected", "ambiguous")
"""Verdicts that are right for an effect outside the library, if no step gives it a single name."""
TOLD_APART = 5.0
"""Least d′ at which a rival, or the healthy arm, counts as distinguishable."""


@dataclass(frozen=True)
class Score:
    """Score of an answer; None for questions that do not apply."""

    strict: bool | None = None
    answered: bool | None = None
    sharp: bool | None = None
    joints: bool | None = None
    both: bool | None = None
    honest: bool | None = None
    alarm: bool | None = None


QUESTIONS = {
    "strict": "strict name",
    "answered": "in the answer",
    "sharp": "as sharp as allowed",
    "joints": "joint right",
    "both": "pair: both, no other",
    "honest": "not in the library: honest",
    "alarm": "false alarm",
}
"""Fields of a score, in words."""


def names_of(answer: Json) -> list[set[str]]:
    """Returns by adopted step the names that it gives: one, or those of its group."""
    adopted = [step for step in answer["steps"] if step["adopted"]]
    return [{step["effect"], *(member["effect"] for member in step["group"])} for step in adopted]


def score(truth: Json, answer: Json | None) -> Score:
    """Compares an answer (None: there is none) with the truth."""
    case = truth["case"]
    steps = names_of(answer) if answer else []
    verdict = answer["verdict"] if answer else "failed"
    if case == "sound":
        return Score(alarm=verdict != "nothing-significant")
    if case == "open" and not truth["hidden"][0]["in_library"]:
        named = any(len(names) == 1 for names in steps) and verdict != "suspected"
        return Score(honest=verdict in HONEST and not named)
    known = [{_known_as(hidden)} for hidden in truth["hidden"]]
    parts = [right | set(hidden.get("beside", ())) for right, hidden in zip(known, truth["hidden"], strict=True)]
    if case == "pair":
        single = [names for names in steps if len(names) == 1]
        found = [any(names & right for names in single) for right in known]
        no_other = all(any(names & part for part in parts) for names in steps)
        return Score(both=verdict == "named" and all(found) and no_other)
    right, part, joint = known[0], parts[0], truth["hidden"][0]["joint"]
    strict = verdict == "named" and all(len(names) == 1 and names <= part for names in steps)
    strict = strict and any(names == right for names in steps)
    answered = any(names & right for names in steps)
    places = [step["joints"] for step in (answer or {}).get("steps", []) if step["adopted"] and step["effect"] in right]
    wanted = [] if joint is None else [joint]
    return Score(strict, answered, _as_sharp(truth, steps, strict, answered), _same(places, wanted))


def _known_as(hidden: Json) -> str:
    """Returns the library's name of a hidden effect; folders of earlier versions have only the drawn name."""
    return str(hidden.get("known_as") or hidden["name"])


def _same(places: Sequence[list[int]], wanted: list[int]) -> bool | None:
    return all(place == wanted for place in places) if places else None


def _as_sharp(truth: Json, steps: list[set[str]], strict: bool, answered: bool) -> bool | None:
    """Whether the answer is as sharp as the record allows.

    That is the name alone if it can be distinguished from every other, or a group of those that cannot. None if named
    rivals were not compared, or if the effect cannot be distinguished from a healthy arm.
    """
    rivals = truth.get("sharpness")
    if not rivals or any(rival["name"] == "none" and rival["d_prime"] < TOLD_APART for rival in rivals):
        return None
    compared = {rival["name"] for rival in rivals} | {_known_as(truth["hidden"][0])}
    if not strict and not all(names <= compared for names in steps):
        return None
    untold = {rival["name"] for rival in rivals if rival["d_prime"] < TOLD_APART}
    right = {_known_as(truth["hidden"][0])}
    if not untold - right:
        return strict
    return strict or (answered and all(names <= untold | right for names in steps))


def diagnose(lab: Path, longest: float = LONGEST) -> Json | None:
    """Returns the command's answer in a rig's folder, from its own records alone; None if it fails or is too late."""
    command = [str(Path(sys.executable).parent / "daq"), "diagnose", "training.csv", "--holdout", "held_out.csv"]
    environment = {name: value for name, value in os.environ.items() if not name.upper().startswith("DAQ_")}
    try:
        run = subprocess.run(
            [*command, "--model", "machine.toml", "--json"],
            cwd=lab,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=longest,
        )
    except subprocess.TimeoutExpired:
        print(f"{lab}: no answer within {longest:.0f} s", file=sys.stderr)
        return None
    if run.returncode:
        print(f"{lab}: exit code {run.returncode}: {run.stderr.strip()[-300:]}", file=sys.stderr)
        return None
    answer: Json = json.loads(run.stdout)
    return answer


def judged(folder: Path, kind: str, seed: int, case: str | None, *, sharp: bool) -> tuple[Json, Json | None, float]:
    """Returns truth, answer and seconds of one rig; computes missing ones."""
    place = folder / f"{kind}-{seed}-{case or case_of(seed)}"
    kept = place / "answer.json"
    if not kept.exists():
        write_rig(place, kind, seed, case, sharp=sharp)
        begun = monotonic()
        answer = diagnose(place / "lab")
        kept.write_text(json.dumps({"answer": answer, "seconds": monotonic() - begun}), "utf-8")
    found = json.loads(kept.read_text("utf-8"))
    return json.loads((place / "truth.json").read_text("utf-8")), found["answer"], found["seconds"]


def table(scores: dict[str, list[Score]]) -> list[str]:
    """Returns rates by kind: right answers of those that apply."""
    lines = [f"{'kind':<18}" + "".join(f"{words:>28}" for words in QUESTIONS.values())]
    everything = [one for some in scores.values() for one in some]
    for kind, some in [*scores.items(), ("all", everything)]:
        cells = []
        for question in QUESTIONS:
            asked = [getattr(one, question) for one in some if getattr(one, question) is not None]
            cells.append(f"{sum(asked)} of {len(asked)}" if asked else "-")
        lines.append(f"{kind:<18}" + "".join(f"{cell:>28}" for cell in cells))
    return lines


def seeds_of(text: str) -> Iterable[int]:
    """Parses 0-4, or 3,7."""
    if "-" in text:
        first, last = text.split("-")
        return range(int(first), int(last) + 1)
    return [int(part) for part in text.split(",")]


# --- Checks whether the intervals of an answer cover the truth of a rig, for sizes that both sides define alike
#
# A size counts if the rig's law is the library's own: a hardening spring, for example, has no single stiffness.


@dataclass(frozen=True)
class _Size:
    """A parameter of the library, and its value on the rig's side: from the joint's parameters and the drawn sizes.

    laws: those in which the rig has the library's law; None for all.
    """

    part: str
    true: Callable[[Json, Json], float]
    laws: tuple[int, ...] | None = None


def _drawn(name: str) -> Callable[[Json, Json], float]:
    return lambda _, sizes: float(sizes[name])


def _of_joint(name: str) -> Callable[[Json, Json], float]:
    return lambda joint, _: float(joint[name])


SIZES: dict[str, tuple[_Size, ...]] = {
    "coulomb_friction": (_Size("torque", _of_joint("coulomb")),),
    "stribeck_friction": (
        _Size("torque", _drawn("stribeck"), (0,)),
        _Size("speed", _drawn("stribeck_speed"), (0,)),
    ),
    "direction_dependent_friction": (_Size("difference", _drawn("direction")),),
    "gear_loss": (_Size("loss", _drawn("gear_loss"), (0,)),),
    "weakened_magnet": (_Size("loss", _drawn("weaker")),),
    "motor_inductance": (_Size("inductance", _of_joint("inductance")),),
    "resistance_drift": (_Size("heating", _of_joint("heating"), (0, 1)),),
    "dead_zone": (_Size("width", _drawn("dead_zone"), (0,)),),
    "amplifier_threshold": (_Size("width", _drawn("dead_zone"), (1,)),),
    "supply_limit": (_Size("voltage", _drawn("supply")),),
    "joint_compliance": (_Size("compliance", lambda joint, _: 1.0 / float(joint["stiffness"]), (0, 2)),),
    "backlash": (_Size("gap", _drawn("gap"), (0,)),),
    "payload": (_Size("mass", _drawn("load")),),
    "link_mass": (_Size("added", _drawn("mass")),),
    "centre_of_mass": (_Size("shift", _drawn("shift")),),
    "spring_torque": (_Size("stiffness", _drawn("spring"), (0,)), _Size("rest", _drawn("spring_rest"), (0,))),
    "torque_ripple": (_Size("cycles", _drawn("ripple_cycles"), (0,)),),
    "periodic_disturbance": (_Size("frequency", _drawn("disturbance_frequency"), (0,)),),
    "potentiometer_gain": (_Size("relative", _drawn("sensor_gain")),),
    "potentiometer_offset": (_Size("offset", _drawn("sensor_offset")),),
    "wrong_gain": (_Size("relative", _drawn("gain_error")),),
    "lost_set_points": (_Size("share", _drawn("lost")),),
}
"""Sizes of each effect that can be compared, by the library's name."""


def covered(truth: Json, answer: Json | None) -> list[bool]:
    """Returns whether each interval of a single effect covers the true size, if it was named at its joint, alone or in
    a group."""
    if truth["case"] != "single" or answer is None:
        return []
    hidden = truth["hidden"][0]
    joints = [] if hidden["joint"] is None else [hidden["joint"]]
    joint = truth["joints"][(hidden["joint"] or 1) - 1]
    found = []
    for step in answer["steps"]:
        if not step["adopted"] or step["effect"] != hidden["known_as"] or step["joints"] != joints:
            continue
        for size in SIZES.get(step["effect"], ()):
            if size.laws is not None and hidden["law"] not in size.laws:
                continue
            own = [value for value in step["parameters"].values() if value["part"] == size.part]
            found += [
                value["low"] <= size.true(joint, hidden["sizes"]) <= value["high"]
                for value in own
                if value["low"] is not None and value["high"] is not None
            ]
    return found


def main() -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m trials.judge", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--kinds", default="tuning", help="tuning, reporting, or names: axis-pid,planar-pid")
    parser.add_argument("--seeds", type=seeds_of, default=range(5))
    parser.add_argument("--case", choices=CASES, help="instead of each seed's own")
    parser.add_argument("--folder", type=Path, help="keep rigs and answers here")
    parser.add_argument("--sharpness", action="store_true", help="also which laws the records can distinguish")
    parser.add_argument("--reporting", action="store_true", help="allow kinds for reports to be looked at")
    asked = parser.parse_args()
    groups = {"tuning": list(TUNING), "reporting": list(REPORTING)}
    named = [*groups, *KINDS]
    chosen = groups.get(asked.kinds) or asked.kinds.split(",")
    unknown = [kind for kind in chosen if kind not in KINDS]
    if unknown:
        near = get_close_matches(unknown[0], named, n=5, cutoff=0.0)
        parser.error(f"--kinds {unknown[0]}: there is none of that name; the nearest are {', '.join(near)}")
    if not asked.reporting and any(kind in REPORTING for kind in chosen):
        parser.error("a kind for reports must not be looked at during tuning; give --reporting if this is a report")
    folder = asked.folder or Path(tempfile.mkdtemp(prefix="rigs-"))
    scores: dict[str, list[Score]] = {kind: [] for kind in chosen}
    for seed in asked.seeds:
        for kind in chosen:
            truth, answer, seconds = judged(folder, kind, seed, asked.case, sharp=asked.sharpness)
            scores[kind].append(score(truth, answer))
            hidden = ", ".join(f"{_known_as(one)} {one['joint'] or ''}" for one in truth["hidden"]) or truth["case"]
            said = answer["verdict"] if answer else "failed"
            names = "; ".join(" | ".join(sorted(names)) for names in names_of(answer or {"steps": []}))
            print(f"{kind} {seed}: {hidden} -> {said}: {names} ({seconds:.0f} s)", flush=True)
    print("\n" + "\n".join(table(scores)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
