"""Motions designed for pairs of rivals beside the best preset: separation predicted, and achieved on the mock.

    python -m benchmarks designed_motions --arms 200-299 --pairs 30 --folder FOLDER      resumes where it was
    python -m benchmarks designed_motions --quick                                        two pairs

An arm of the mock hides one effect; its number draws effect, size, joint and all tolerances. The ramp step (8 s) is
recorded, and the candidates on the effect's joint are fitted to it. The effect and the rival that comes nearest to it
are a pair, if the record leaves them undecided: evidence less than 20 apart, and the effect itself significant.

For each pair the best preset and the motion that is designed for it are both run on the mock, which shares no code with
the model. Achieved is the separation that a diagnosis gets: both are fitted to the ramp step and the new record; d′² is
what the new record adds to the cost of the rival, less what it adds to that of the effect. Predictions are the smaller
of the two directions; achieved is the one that is true. Arms 0 to 99 are for tuning.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.figures import Figure, show
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.progress import Never, silent
from daq.contracts.trace import Trace
from daq.safety.planned import planned
from daq.traces.reader import read_trace
from daq.trajectories.offered import offered_experiments
from daq_cli.trial.experiments import trial_experiment
from daq_cli.trial.mock_side import reveal
from daq_cli.trial.recording import record
from model.discrepancy.candidates.candidate_fit import CandidateFit, judge, refit
from model.discrepancy.candidates.ranking import Ranking, rank
from model.discrepancy.diagnosis import PlacedEffect
from model.discrepancy.experiment_design.inseparable import classes_of
from model.discrepancy.experiment_design.next_experiment import (
    LONGEST_DESIGN,
    SURE,
    ExperimentChooser,
    converge_rivals,
    judge_experiments,
)
from model.discrepancy.experiment_design.prediction import starts_at_rest
from model.discrepancy.experiment_design.search import MotionSearch, designed_motions
from model.discrepancy.experiment_design.separation import ENOUGH, LEAST, Separations
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.case import build_case
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, converge, point_at
from model.discrepancy.thresholds import THRESHOLDS
from model.machine_model.model import base_model

Json = dict[str, Any]

MACHINE = load_machine("ma2000")
SINGLE = 20
"""Seed of an arm with one hidden effect: 100 times its number, and this."""
PROVED = ("wrong_gain", "lost_set_points")
"""Effects that the controller's own numbers prove: no experiment is asked for."""
PAIR = (0, 1)
SCATTER = 2.0
"""Standard deviations by which a measured separation may be below another one by chance. That of d′ is 1."""


@dataclass(frozen=True)
class Rivals:
    """The effect that an arm hides and the rival that comes nearest to it, fitted to the ramp step."""

    trace: Trace
    fits: tuple[CandidateFit, CandidateFit]
    gap: float


def rivals_of_arm(seed: int, truth: Json, folder: Path) -> Rivals | None:
    """The pair of an arm; None where the ramp step decides, or does not show the effect."""
    trace = measured(seed, "ramp", trial_experiment("ramp"), folder)
    point = converge(point_at(*observe(base_model(MACHINE), [trace])), 6)
    joints = tuple(truth["joints"]) or None
    options = DiagnosisOptions(joints=joints)
    case = build_case(point.model, point, point, [trace], options=options, excluded=PROVED)
    ranking = rank(case, judge(point), silent, Never())
    true = _fit_of(ranking, truth, judge(point).point)
    others = [f for f in ranking.fitted if f.hypothesis.name != truth["effect"]]
    if true is None or true.evidence < THRESHOLDS.significant or not others:
        return None
    rival = min(others, key=lambda f: abs(f.evidence - true.evidence))
    if abs(rival.evidence - true.evidence) >= SURE:
        return None
    ended = converge_rivals((true, rival))
    return Rivals(trace, (ended[0], ended[1]), true.evidence - rival.evidence) if len(ended) == 2 else None


def _fit_of(ranking: Ranking, truth: Json, before: Point) -> CandidateFit | None:
    """The fit of the hidden effect, made now where the ranking has none."""
    same = [f for f in ranking.fitted if f.hypothesis.name == truth["effect"]]
    if same:
        return same[0]
    probes = [p for p in ranking.probed if p.hypothesis.name == truth["effect"]]
    return refit(judge(before), probes[0]) if probes else None


def measured(seed: int, run: str, spec: ExperimentSpec, folder: Path) -> Trace:
    """What an experiment gives on the arm of a seed."""
    found = record(seed, run, spec, MACHINE, folder)
    if found.outcome != "complete":
        raise RuntimeError(f"{run} ended {found.outcome}: {found.reason}")
    return read_trace(found.file)


def achieved(rivals: Rivals, new: Trace) -> float:
    """d′ of the rival from the hidden effect on a new record; 0 where the rival fits it better."""
    true, wrong = (_again(f.fit.point, [rivals.trace, new]).cost - f.fit.point.cost for f in rivals.fits)
    return float(np.sqrt(max(wrong - true, 0.0)))


def _again(point: Point, traces: Sequence[Trace]) -> Point:
    """A rival fitted anew to one more trace, from where it was and at rest."""
    observation, given = observe(point.model, traces)
    shared = point.only([k for k, u in enumerate(point.unknowns) if u.trace is None])
    known = point.by_name
    starts = [u for u in given.unknowns if u.trace is not None]
    new = [u for u in starts if u.name not in known]
    values = [*(known[u.name] for u in starts if u.name in known), *starts_at_rest(observation, shared, new)]
    unknowns = (*shared.unknowns, *(u for u in starts if u.name in known), *new)
    begun = Calibration(point.model, unknowns, np.array([*shared.values, *values]))
    return converge(point_at(observation, begun), 6)


def studied(number: int, folder: Path) -> Json | None:
    """One arm: its pair, the best preset and the designed motion, predicted and achieved; None where it has no pair."""
    seed = 100 * number + SINGLE
    (truth,) = reveal(seed)["effects"]
    if truth["known_as"] != truth["effect"] or truth["effect"] in PROVED:
        return None
    rivals = rivals_of_arm(seed, truth, folder)
    if rivals is None:
        return None
    chooser = ExperimentChooser(offered_experiments(), lambda spec: planned(spec, MACHINE))
    begun = time.process_time()
    presets, _ = judge_experiments(rivals.fits, chooser, [PAIR], Never())
    between = time.process_time()
    designed, count = designed_motions(rivals.fits, [PAIR], chooser.imagine, MotionSearch(), LONGEST_DESIGN, Never())
    ended = time.process_time()
    best = max(presets, key=lambda s: (s.worth([PAIR]), s.sizes[PAIR]))
    found: Json = {
        "arm": number,
        "effect": truth["effect"],
        "rival": rivals.fits[1].hypothesis.name,
        "joints": truth["joints"],
        "gap": rivals.gap,
        "seconds": [between - begun, ended - between],
        "judged": count,
        "preset": _row(rivals, best, seed, folder),
        "designed": _row(rivals, designed[0], seed, folder) if designed else None,
    }
    every = [*presets, *designed]
    nearest = max(every, key=lambda s: s.sizes[PAIR])
    if nearest.sizes[PAIR] < LEAST:
        members = [PlacedEffect(effect=f.hypothesis.name, joints=f.hypothesis.joints) for f in rivals.fits]
        (own,) = classes_of(members, {PAIR: (nearest.sizes[PAIR], nearest.experiment.name)}, len(presets) + count)
        found["class"] = own.model_dump(mode="json")
    return found


def _row(rivals: Rivals, judged: Separations, seed: int, folder: Path) -> Json:
    new = measured(seed, judged.experiment.name, judged.experiment.spec, folder)
    return {
        "name": judged.experiment.name,
        "does": judged.experiment.description,
        "duration": judged.there.duration,
        "predicted": judged.sizes[PAIR],
        "achieved": achieved(rivals, new),
    }


def study(numbers: Sequence[int], pairs: int, folder: Path) -> Iterator[Json]:
    """Pairs of arms, until there are enough; those that the folder has are not done again."""
    path = folder / "pairs.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    done = {entry["arm"]: entry for entry in map(json.loads, lines)}
    count = 0
    for number in numbers:
        if count == pairs:
            return
        if number not in done:
            found = studied(number, folder) or {"arm": number, "effect": None}
            done[number] = found
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
        if done[number]["effect"] is not None:
            count += 1
            _tell(done[number])
            yield done[number]


def _tell(pair: Json) -> None:
    cells = [
        "none"
        if one is None
        else f"{one['duration']:5.1f} s {one['predicted']:6.1f} {one['achieved']:6.1f} {one['name']}"
        for one in (pair["preset"], pair["designed"])
    ]
    seconds = "/".join(f"{s:.0f}" for s in pair["seconds"])
    names = f"{pair['effect']} | {pair['rival']} {pair['joints']}"
    print(f"{pair['arm']:4d} {names:<62} {cells[0]:<46} {cells[1]:<34} {seconds} s", flush=True)


def worth(one: Json, kind: str) -> float:
    """d′² for each second of robot time, of a separation that counts up to `ENOUGH`; 0 below the least that tells."""
    return 0.0 if one[kind] < LEAST else min(one[kind], ENOUGH) ** 2 / one["duration"]


def asked_for(pair: Json) -> Json:
    """What a diagnosis would ask for: the designed motion where it promises more than the best preset."""
    preset, designed = pair["preset"], pair["designed"]
    better = designed is not None and worth(designed, "predicted") > worth(preset, "predicted")
    return designed if better else preset


def figures(pairs: Sequence[Json]) -> list[Figure]:
    """How often what is asked for is better than the best preset, and how well predictions hold."""
    found = [figure for kind in ("predicted", "achieved") for figure in _beside_presets(pairs, kind)]
    ratios = [one["achieved"] / one["predicted"] for one in map(asked_for, pairs)]
    found.append(
        Figure(
            "achieved over predicted separation of what is asked for",
            f"median {np.median(ratios):.2f}",
            beside=_spread(ratios),
        )
    )
    presets, searches = zip(*(p["seconds"] for p in pairs), strict=True)
    beside = f"at most {max(searches):.1f} s; presets {np.median(presets):.1f} s"
    found.append(Figure("processor time of a search", f"median {np.median(searches):.1f} s", beside=beside))
    untold = [p["class"] for p in pairs if "class" in p]
    named = sum(c["shares"] is not None for c in untold)
    value = f"{len(untold)} of {len(pairs)}"
    return [*found, Figure("pairs that no motion tells apart", value, beside=f"{named} of them in a named class")]


def _beside_presets(pairs: Sequence[Json], kind: str) -> list[Figure]:
    """What is asked for beside the best preset: pairs told apart, separation for each second, pairs that are worse."""
    rows = [(asked_for(p), p["preset"]) for p in pairs]
    told = [sum(row[k][kind] >= LEAST for row in rows) for k in (0, 1)]
    gains = [worth(asked, kind) / worth(preset, kind) for asked, preset in rows if worth(preset, kind) > 0]
    worse = sum(_is_worse(asked, preset, kind) for asked, preset in rows)
    return [
        Figure(f"pairs told apart, {kind}", f"{told[0]} of {len(rows)}", "≥ preset", told[0] >= told[1], f"{told[1]}"),
        Figure(f"d′² a second over the best preset's, {kind}", f"median {np.median(gains):.1f}", beside=_spread(gains)),
        Figure(f"pairs for which it is worse than the best preset, {kind}", str(worse), "0", worse == 0),
    ]


def _is_worse(asked: Json, preset: Json, kind: str) -> bool:
    """Whether it gives less for its time than a preset, by more than the noise of a measured separation."""
    scatter = SCATTER if kind == "achieved" else 0.0
    likely = {**asked, kind: asked[kind] + scatter}
    return worth(likely, kind) < worth({**preset, kind: preset[kind] - scatter}, kind) - 1e-9


def _spread(values: Sequence[float]) -> str:
    low, high = np.percentile(values, (10, 90))
    return f"10 to 90 %: {low:.2f} to {high:.2f}; below 1: {sum(v < 1 for v in values)} of {len(values)}"


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks designed_motions", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--arms", default="200-299", help="numbers of arms: 200-299")
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--folder", type=Path, help="where results are kept, to go on later")
    parser.add_argument("--quick", action="store_true", help="two pairs")
    given = parser.parse_args()
    first, _, last = given.arms.partition("-")
    numbers = range(int(first), int(last or first) + 1)
    folder = given.folder or Path(tempfile.mkdtemp(prefix="designed-"))
    folder.mkdir(parents=True, exist_ok=True)
    found = list(study(numbers, 2 if given.quick else given.pairs, folder))
    command = f"python -m benchmarks designed_motions --arms {given.arms} --pairs {given.pairs}"
    return show(f"Designed motions, {len(found)} pairs of rivals on the mock", command, figures(found))


if __name__ == "__main__":
    sys.exit(main())
