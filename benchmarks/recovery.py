"""Parameters recovered from four designed traces of the mock: how often the stated 95 % intervals hold the truth.

    python -m benchmarks recovery --seeds 100 --folder FOLDER        resumes where it was; one line of JSON a seed
    python -m benchmarks recovery --seeds 100 --folder FOLDER --bent  with potentiometers that bend by up to ±0.25 %
    python -m benchmarks recovery --seeds 50 --first 101 …            seeds 101 to 150
    python -m benchmarks recovery --quick                             three seeds

Every seed is an arm of its own: its parameters are drawn from what the machine file expects (value ± deviation),
written into a plant file for the mock, and hidden until the fit has answered. The experiments are designed once, on
the model of the machine file. Counted are the parameters that the identifiability report calls known.

Beside every share stand the mean and the standard deviation of (value − truth) / stated deviation: 0 and 1 where
intervals are right; a mean off 0 is a bias, a deviation above 1 an interval too narrow.

Two boards are studied. With straight potentiometers the fit is told so. With bent ones (what the mock has by default)
the bend is a nuisance within the stated linearity.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from benchmarks.figures import Figure, show
from benchmarks.mock_arm import FRICTION_ARMS, board_text, hidden_parameters, plant_text, recorded
from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.executors import Workers, done_in_any_order, open_workers
from daq.executors.workers import ending
from daq.safety import check_plan
from daq.trajectories.planner import plan, start_angles
from model.design.search import DesignedExperiments, DesignOptions, design
from model.fitting.fit import INTERVAL, fit
from model.fitting.options import FitOptions
from model.machine_model.model import base_model

POOLED = (0.92, 0.98)
EACH = 0.88
LINEARITY = 0.0025
MACHINE = load_machine("ma2000")
DESIGN = DesignOptions(experiments=4, duration=12.0, candidates=48, seed=1)
DESIGN_FILE = "experiments.json"


def designed(folder: Path) -> tuple[ExperimentSpec, ...]:
    """The four experiments, from the folder or designed now."""
    path = folder / DESIGN_FILE
    if not path.exists():
        found = design(base_model(MACHINE), _within_limits, DESIGN)
        path.write_text(found.model_dump_json(indent=1), "utf-8")
    return DesignedExperiments.model_validate_json(path.read_text("utf-8")).specs


def _within_limits(spec: ExperimentSpec) -> np.ndarray:
    own = plan(spec, MACHINE, start_angles(spec, MACHINE))
    for violation in check_plan(own, MACHINE, MACHINE.limits):
        raise SafetyError(violation.message)
    return own.angles


def recover(specs: Iterable[ExperimentSpec], seed: int, bent: bool) -> dict[str, Any]:
    """One arm: its parameters, and what the fit says of them."""
    hidden = hidden_parameters(MACHINE, seed)
    board = board_text(LINEARITY if bent else 0.0)
    traces = recorded(list(specs), MACHINE, seed, plant_text(hidden), board)
    result = fit(base_model(MACHINE), traces, FitOptions(sensor_bend=bent))
    truth = {**hidden, **dict.fromkeys(FRICTION_ARMS, hidden["friction.arm"])}
    found = {
        p.name: {
            "truth": truth.get(p.name, p.expected),
            "verdict": p.verdict,
            "value": p.value,
            "low": p.low,
            "high": p.high,
        }
        for p in result.parameters
    }
    return {
        "seed": seed,
        "bent": bent,
        "parameters": found,
        "converged": result.converged,
        "seconds": result.seconds,
        "whitened_mean_square": result.whitened_mean_square,
    }


@dataclass(frozen=True)
class Recovering:
    """What a worker does with a seed."""

    specs: tuple[ExperimentSpec, ...]
    bent: bool

    def __call__(self, seed: int) -> dict[str, Any]:
        return recover(self.specs, seed, self.bent)


def study(seeds: range, folder: Path, bent: bool, workers: Workers) -> list[dict[str, Any]]:
    """Every seed once; those that the folder has are not done again."""
    specs = designed(folder)
    path = folder / ("bent.jsonl" if bent else "straight.jsonl")
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    done = {entry["seed"]: entry for entry in map(json.loads, lines)}
    left = [seed for seed in seeds if seed not in done]
    for seed, future in done_in_any_order(workers, Recovering(specs, bent), left):
        done[seed] = future.result()
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(done[seed]) + "\n")
        print(f"  seed {seed} of {seeds[-1]}: fit {done[seed]['seconds']:.1f} s", file=sys.stderr, flush=True)
    return [done[seed] for seed in seeds]


def figures(entries: list[dict[str, Any]]) -> list[Figure]:
    """Coverage of every parameter that is called known, and of all together."""
    found: dict[str, list[Known]] = {}
    for entry in entries:
        for name, p in entry["parameters"].items():
            if p["verdict"] == "known":
                found.setdefault(name, []).append(_known(p))
    table = [
        _figure(name, each, f"≥ {EACH:.0%}", len(each) < 10 or _share(each) >= EACH)
        for name, each in sorted(found.items())
    ]
    pooled = [one for each in found.values() for one in each]
    inside = bool(pooled) and POOLED[0] <= _share(pooled) <= POOLED[1]
    return [_figure("pooled", pooled, f"{POOLED[0]:.0%} to {POOLED[1]:.0%}", inside), *table]


@dataclass(frozen=True)
class Known:
    """One parameter of one arm: whether its interval holds the truth, and how far off it is in stated deviations."""

    held: bool
    off: float


def _known(p: dict[str, Any]) -> Known:
    deviation = (p["high"] - p["low"]) / (2 * INTERVAL)
    return Known(p["low"] <= p["truth"] <= p["high"], (p["value"] - p["truth"]) / deviation)


def _share(found: list[Known]) -> float:
    return float(np.mean([one.held for one in found]))


def _figure(name: str, found: list[Known], target: str, met: bool) -> Figure:
    if not found:
        return Figure(name, "none called known", target, False)
    interval = binomtest(sum(one.held for one in found), len(found)).proportion_ci(0.95, "wilson")
    off = np.array([one.off for one in found])
    beside = f"95 % interval {interval.low:.0%} to {interval.high:.0%}; off by {off.mean():+.2f} ± {off.std():.2f}"
    return Figure(name, f"{_share(found):.1%} of {len(found)}", target, met, beside)


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks recovery", description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--folder", type=Path, help="where results are kept, to go on later")
    parser.add_argument("--bent", action="store_true", help="potentiometers that bend")
    parser.add_argument("--executor", default="local://1", help="who computes, as `daq batch --executor`")
    parser.add_argument("--quick", action="store_true", help="three seeds")
    given = parser.parse_args()
    seeds = range(given.first, given.first + (3 if given.quick else given.seeds))
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        with ending(open_workers(given.executor)) as workers:
            entries = study(seeds, folder, given.bent, workers)
    board = "bent by up to ±0.25 %" if given.bent else "straight"
    title = f"Recovery of {len(seeds)} hidden arms, potentiometers {board}"
    command = f"python -m benchmarks recovery --seeds {len(seeds)} --first {given.first}"
    command += " --bent" if given.bent else ""
    return show(title, command, figures(entries))


if __name__ == "__main__":
    sys.exit(main())
