"""`python -m mock_controller.detectability SEED… --experiment FILE`: how well the effects of a secret arm can be seen.

Prints one line of JSON per arm: d′ of all its effects together and of each with the others acting, after a refit of the
tolerance parameters. It reveals what the seeds hide, and is meant for scoring answers. Exit code 2 for wrong options.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, cast

from mock_controller.board import default_board
from mock_controller.hidden.arm import LOAD_KG, HiddenArm, Load, draw_arm, loaded
from mock_controller.hidden.experiment import BUILT_IN, Experiment, read_experiment
from mock_controller.hidden.separation import MOST_REFITS, Priors, Tangents, modelled_readings, separation, tangents
from mock_controller.plant import default_plant


def main(arguments: list[str]) -> int:
    """Prints d′ of every seed; returns the exit code."""
    given = _parser().parse_args(arguments)
    try:
        arms = [draw_arm(seed) for seed in given.seeds]
        experiment = _experiment(given.experiment, tuple(given.gains))
        known: dict[Load, Tangents] = {}
        for arm in arms:
            if arm.load not in known:
                known[arm.load] = load_tangents(
                    arm.load, experiment, cast(Priors, given.priors), given.processes, given.cache
                )
            print(json.dumps(detectability(arm, experiment, known[arm.load], given.refits)), flush=True)
    except ValueError as error:
        print(f"mock_controller.detectability: {error}", file=sys.stderr)
        return 2
    return 0


def load_tangents(
    load: Load, experiment: Experiment, priors: Priors = "stated", processes: int = 1, cache: Path | None = None
) -> Tangents:
    """Returns tangents of the tolerance parameters for the arm of the data files with one of its loads."""
    return tangents(loaded(default_plant(), load), default_board(), experiment, priors, processes, cache)


def detectability(arm: HiddenArm, experiment: Experiment, known: Tangents, refits: int = MOST_REFITS) -> dict[str, Any]:
    """Returns d′ of all effects of an arm together (0 for a clean one), and of each while the others act.

    With several effects, d′ of all together is only the tangents' estimate, because no decision depends on it.
    """
    plant, board = default_plant(), default_board()
    if not arm.effects:
        return {"seed": arm.seed, "load_kg": LOAD_KG[arm.load], "d_prime": 0.0, "effects": []}
    parts = arm.parts(plant, board)
    present = modelled_readings(parts, experiment)
    together = separation(parts, experiment, known, refits=refits if len(arm.effects) == 1 else 0, present=present)
    alone = (
        [together]
        if len(arm.effects) == 1
        else [
            separation(parts, experiment, known, arm.modifications(leave_out=index), refits, present)
            for index in range(len(arm.effects))
        ]
    )
    return {
        "seed": arm.seed,
        "load_kg": LOAD_KG[arm.load],
        "d_prime": together.d_prime,
        "effects": [
            {
                "effect": effect.name,
                "joints": list(effect.joints),
                "d_prime": found.d_prime,
                "before_refit": found.before_refit,
                "refit_moved": {name: value for name, value in found.moved.items() if abs(value) > 1.0},
            }
            for effect, found in zip(arm.effects, alone, strict=True)
        ],
    }


def _experiment(name: str, gains: tuple[int, int, int]) -> Experiment:
    if name in BUILT_IN:
        built_in = BUILT_IN[name]()
        return Experiment(built_in.set_points, gains)
    return read_experiment(Path(name), gains)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m mock_controller.detectability", description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+", metavar="SEED")
    parser.add_argument(
        "--experiment",
        default="reference-set",
        metavar="FILE",
        help=f"CSV, one line per period, set_point_1 to set_point_6 in posture units; or {' or '.join(BUILT_IN)}",
    )
    parser.add_argument("--gains", type=int, nargs=3, default=(2, 0, 0), metavar=("P", "I", "D"), help="(2 0 0)")
    parser.add_argument(
        "--priors",
        choices=("stated", "drawn"),
        default="stated",
        help="deviations that the refit expects: those stated to others, or those from which arms are drawn",
    )
    parser.add_argument("--refits", type=int, default=MOST_REFITS, help=f"({MOST_REFITS})")
    parser.add_argument("--processes", type=int, default=1, help="for the tangents (1)")
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help="keeps tangents for later runs")
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
