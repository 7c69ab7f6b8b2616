"""Potentiometers that a seed hides, found again with a protractor: how often the stated intervals hold the truth.

python -m benchmarks secret_sensors                  100 arms of the mock, joints 1 to 3
python -m benchmarks secret_sensors --seeds 0-9      others

Each joint is moved by hand, with the emergency stop pressed, to six postures; its angle is read to half a degree, and
the reading is taken as `daq commission` takes it. Exit code 1 when a target is missed.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter

from benchmarks.figures import Figure, at_least, at_most, show
from benchmarks.secret_maps import BoardArm, BoardPage
from daq.commissioning.memory.procedure import Task
from daq.commissioning.potentiometer import calibrate_potentiometer
from daq.contracts.machine import load_machine
from daq_cli.commands.commission.by_hand import AVERAGED
from daq_cli.robot.mock_hand import MockOperator
from daq_cli.robot.safe_release import typical
from firmware_protocol.memory_map import default_memory_map
from mock_controller.device import build_device
from mock_controller.options import Options

JOINTS, POSTURES = (1, 2, 3), 6
SEEDS = range(20_000, 20_100)
LEAST, MOST = 0.92, 0.98
"""Shares between which intervals of 95 % are to hold the truth."""


def count_held(seed: int) -> Counter[str]:
    """How many joints of one arm: all, those with the right direction, and those whose range and zero are held."""
    options = Options(tcp="nowhere:0", secret_sensors=seed, seed=seed, lock_step=True)
    board = build_device(options, lambda _: None).board
    page, memory_map = BoardPage(board), default_memory_map()
    operator = MockOperator(BoardArm(board), load_machine("ma2000"))
    operator.begin(Task("press_emergency_stop"))
    held: Counter[str] = Counter()
    for joint in JOINTS:
        counts, angles = [], []
        for number in range(1, POSTURES + 1):
            angle = operator.read_angle(joint, number, page.wait)
            assert angle is not None
            counts.append(typical(page, memory_map, "position", AVERAGED)[joint])
            angles.append(math.radians(angle))
        found, truth = calibrate_potentiometer(joint, counts, angles), board.parameters.calibrations[joint - 1]
        held["all"] += 1
        held["direction"] += found.direction == truth.direction
        held["range"] += found.range.holds(truth.range_rad)
        held["zero"] += found.at_zero.holds(truth.angle_at_zero_rad)
    return held


def _range(text: str) -> range:
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main(arguments: list[str]) -> int:
    """Prints the figures; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks secret_sensors", description=__doc__)
    parser.add_argument("--seeds", type=_range, metavar="FIRST-LAST", default=SEEDS)
    seeds = parser.parse_args(arguments).seeds
    held: Counter[str] = sum((count_held(seed) for seed in seeds), Counter())
    figures: list[Figure] = [at_least("directions found", held["direction"] / held["all"], 1, "of all")]
    for name in ("range", "zero"):
        share = held[name] / held["all"]
        figures += [
            at_least(f"intervals that hold the {name}", share, LEAST, "of all"),
            at_most(f"intervals that hold the {name}, too wide", share, MOST, "of all"),
        ]
    return show(f"{held['all']} secret potentiometers", "python -m benchmarks secret_sensors", figures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
