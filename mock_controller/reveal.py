"""`python -m mock_controller.reveal SEED…`: prints the secrets of `--secret SEED` arms, one line of JSON each.

With `--memory-map` it prints those of `--secret-map SEED`, with `--sensors` those of `--secret-sensors SEED`, and with
`--servos` those of `daq mock dynamixel --secret SEED`. For scoring answers after they have been given. Exit code 2 for
invalid seeds.
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from mock_controller.board.parameters import default_board
from mock_controller.hidden.arm import draw_arm
from mock_controller.hidden.memory import draw_memory
from mock_controller.hidden.sensors import draw_sensors, truth_of
from mock_controller.servos.plant import draw_secret


def main(arguments: list[str]) -> int:
    """Prints the truth; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m mock_controller.reveal", description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+", metavar="SEED")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--memory-map", action="store_true", help="the seeds are those of --secret-map")
    kind.add_argument("--sensors", action="store_true", help="the seeds are those of --secret-sensors")
    kind.add_argument("--servos", action="store_true", help="the seeds are those of a bench of servos")
    parser.add_argument("--documented", choices=("kept", "moved"), default="kept", help="as given to the mock")
    given = parser.parse_args(arguments)
    truths: list[Any]
    try:
        if given.memory_map:
            truths = [draw_memory(seed, given.documented).truth() for seed in given.seeds]
        elif given.sensors:
            stated = default_board().calibrations
            truths = [{"seed": seed, "sensors": truth_of(draw_sensors(seed, stated))} for seed in given.seeds]
        elif given.servos:
            truths = [draw_secret(seed).truth(seed) for seed in given.seeds]
        else:
            truths = [draw_arm(seed).truth() for seed in given.seeds]
    except ValueError as error:
        print(f"mock_controller.reveal: {error}", file=sys.stderr)
        return 2
    for truth in truths:
        print(json.dumps(truth))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
