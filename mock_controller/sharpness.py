"""`python -m mock_controller.sharpness SEED --experiment FILE… --rival NAME[:JOINTS]…`: computes which effects the
records of a secret arm can distinguish from its hidden one.

Prints one line of JSON: d′ of each rival after a refit of its parameters and of the tolerance parameters. A rival is
tried at the joints of the hidden effect, and at those that are named. It reveals the secret of the seed, and is meant
for scoring answers. Exit code 2 for wrong options.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

from mock_controller.detectability import load_tangents
from mock_controller.hidden.arm import HiddenArm, draw_arm
from mock_controller.hidden.experiment import BUILT_IN, Experiment, read_experiment
from mock_controller.hidden.rivals import RivalError, places_of
from mock_controller.hidden.separation import Tangents
from mock_controller.hidden.sharpness import Comparison, Told
from mock_controller.modifications.registry import known_modifications

Named = tuple[str, tuple[int, ...]]


def main(arguments: list[str]) -> int:
    """Prints d′ of the rivals; returns the exit code."""
    given = _parser().parse_args(arguments)
    begun = time.monotonic()
    try:
        arm = draw_arm(given.seed)
        named = [parse_rival(text) for text in given.rival]
        experiments = [
            BUILT_IN[name]() if name in BUILT_IN else read_experiment(Path(name)) for name in given.experiment
        ]
        known = [load_tangents(arm.load, experiment, cache=given.cache) for experiment in experiments]
        found = sharpness(arm, experiments, known, named)
    except ValueError as error:
        print(f"mock_controller.sharpness: {error}", file=sys.stderr)
        return 2
    print(json.dumps({"seed": arm.seed, "rivals": found, "seconds": round(time.monotonic() - begun, 1)}))
    return 0


def sharpness(
    arm: HiddenArm, experiments: list[Experiment], known: list[Tangents], named: list[Named]
) -> list[dict[str, Any]]:
    """Returns the least d′ of each rival over the joints where it is tried, and the joints there.

    `known`: the tangents of each experiment.
    """
    compared = Comparison(arm, experiments, known)
    hidden = arm.effects[0]
    found: dict[str, Told] = {}
    for effect, joints in named:
        if effect == hidden.known_as:
            continue
        for place in dict.fromkeys([*places_of(effect, hidden.joints), *([joints] if joints else [])]):
            told = compared.rival(effect, place)
            if effect not in found or told.d_prime < found[effect].d_prime:
                found[effect] = told
    return [
        {"effect": told.effect, "joints": list(told.joints), "d_prime": told.d_prime, "linear": told.linear}
        for told in found.values()
    ]


def parse_rival(text: str) -> Named:
    """Parses a name, and perhaps joints: `gear_loss`, `gear_loss:1` or `gear_loss:1,3`. Raises RivalError."""
    effect, _, after = text.partition(":")
    known = known_modifications().get(effect)
    if known is None or not known.shared:
        raise RivalError(f"rival {effect!r}: is not an effect of the shared list")
    try:
        joints = tuple(int(part) for part in after.split(",")) if after else ()
    except ValueError:
        raise RivalError(f"rival {text!r}: write NAME or NAME:1,2") from None
    return effect, joints


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m mock_controller.sharpness", description=__doc__)
    parser.add_argument("seed", type=int, metavar="SEED")
    parser.add_argument(
        "--experiment",
        action="append",
        required=True,
        metavar="FILE",
        help=f"one of the experiments recorded together: CSV or JSON of set points, or {' or '.join(BUILT_IN)}",
    )
    parser.add_argument("--rival", action="append", required=True, metavar="NAME[:JOINTS]")
    parser.add_argument("--cache", type=Path, metavar="FOLDER", help="keeps tangents for later runs")
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
