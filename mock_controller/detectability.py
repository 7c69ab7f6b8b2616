"""`python -m mock_controller.detectability SEED… --experiment FILE`: how well the effects of a secret arm can be seen.

Prints one line of JSON per arm: d′ of all its effects together and of each with the others acting, after a refit of the
tolerance parameters. It reveals what the seeds hide, and is meant for scoring answers. Exit code 2 for wrong options.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from mock_controller.board import default_board
from mock_controller.hidden.arm import LOAD_KG, HiddenArm, Load, draw_arm, loaded
from mock_controller.hidden.experiment import Experiment, read_experiment
from mock_controller.hidden.separation import MOST_REFITS, Tangents, modelled_readings, separation, tangents
from mock_controller.plant import default_plant


def main(arguments: list[str]) -> int:
    """Prints d′ of every seed; returns the exit code."""
    given = _parser().parse_args(arguments)
    try:
        arms = [draw_arm(seed) for seed in given.seeds]
        experiment = read_experiment(given.experiment)
        known: dict[Load, Tangents] = {}
        for arm in arms:
            if arm.load not in known:
                known[arm.load] = tangents(loaded(default_plant(), arm.load), default_board(), experiment, given.cache)
            print(json.dumps(detectability(arm, experiment, known[arm.load])), flush=True)
    except ValueError as error:
        print(f"mock_controller.detectability: {error}", file=sys.stderr)
        return 2
    return 0


def detectability(arm: HiddenArm, experiment: Experiment, known: Tangents) -> dict[str, Any]:
    """Returns d′ of all effects of an arm together (0 for a clean one), and of each while the others act.

    With several effects, d′ of all together is only the tangents' estimate, because no decision depends on it.
    """
    plant, board = default_plant(), default_board()
    if not arm.effects:
        return {"seed": arm.seed, "load_kg": LOAD_KG[arm.load], "d_prime": 0.0, "effects": []}
    parts = arm.parts(plant, board)
    present = modelled_readings(parts, experiment)
    together = separation(parts, experiment, known, refits=MOST_REFITS if len(arm.effects) == 1 else 0, present=present)
    alone = (
        [together]
        if len(arm.effects) == 1
        else [
            separation(parts, experiment, known, arm.modifications(leave_out=index), present=present)
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


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m mock_controller.detectability", description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+", metavar="SEED")
    parser.add_argument(
        "--experiment",
        type=Path,
        required=True,
        metavar="FILE",
        help="CSV, one line per period, set_point_1 to set_point_6 in posture units",
    )
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help="keeps tangents for later runs")
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
