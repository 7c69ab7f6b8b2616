"""The noise floor of the time-domain form: records of the model's own law, fitted rightly, over their noise floor.

    python -m benchmarks.noise_floor [--seeds N]

Per kind of motion and joint: the residual's rms over the noise floor (median, 5th and 95th percentile over seeds), and
over what the readings' noise alone would leave, for which there is a formula. The seeds of the records are not those
with which the floor is drawn.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import numpy as np

from benchmarks.figures import Figure, show
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.validation.acceleration_model import expected_accelerations
from model.validation.measured_motion import observe
from model.validation.noise_floor import noise_floor
from tests.model.fitting.imagined import arm
from tests.model.validation.synthetic import multisine_trace, ramp_trace, swinging_trace

MOTIONS: dict[str, Callable[[Model, int], Trace]] = {
    "ramp step, 1.6 s": lambda model, seed: ramp_trace(model, seed=seed, held=True),
    "two sines a joint, 6 s": lambda model, seed: swinging_trace(model, seed=seed, held=True),
    "multisine 0.1 to 0.8 Hz, 12 s": lambda model, seed: multisine_trace(model, seed=seed, held=True),
}
FIRST_SEED = 5000


def main() -> int:
    """The exit code: 1 when a median lies outside 0.9 to 1.1."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.noise_floor", description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    seeds = parser.parse_args().seeds
    model = arm()
    figures = []
    for name, make in MOTIONS.items():
        ratios, plain = ratios_of(model, make, range(FIRST_SEED, FIRST_SEED + seeds))
        for j in range(model.joint_count):
            low, middle, high = np.percentile(ratios[:, j], (5, 50, 95))
            beside = f"5 to 95 %: {low:.2f} to {high:.2f}; over the readings' noise alone {np.median(plain[:, j]):.2f}"
            figures.append(
                Figure(f"{name}, joint {j + 1}", f"{middle:.2f}", "0.9 to 1.1", 0.9 <= middle <= 1.1, beside=beside)
            )
    return show("The noise floor of the time-domain form", "python -m benchmarks noise_floor", figures)


def ratios_of(model: Model, make: Callable[[Model, int], Trace], seeds: range) -> tuple[np.ndarray, np.ndarray]:
    """(s, n) residual rms over the noise floor, and over the readings' noise."""
    ratios, plain = [], []
    for seed in seeds:
        trace = make(model, seed)
        seen = observe(model, trace)
        floor, _ = noise_floor(model, trace, seen)
        left = np.where(seen.usable, seen.acceleration - expected_accelerations(model, seen.motion, ())[0], 0.0)
        rms = np.sqrt((left**2).sum(axis=0) / seen.usable.sum(axis=0))
        ratios.append(rms / floor)
        plain.append(rms / seen.noise)
    return np.array(ratios), np.array(plain)


if __name__ == "__main__":
    sys.exit(main())
