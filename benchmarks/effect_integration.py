"""Every effect against an outside integrator in continuous time, on every joint, at the steps that are used.

    python -m benchmarks.effect_integration [EFFECT ...]

The outside integrator (tests/model/simulation/continuous_time.py) has the arm's equations and every effect written a
second time, and steps of 10 µs. An error is the largest of any reading along a ramp of 33°/s up and down (1.3 s), in
counts of the sensor. Steps of 7 ms are taken for differences alone (derivatives, probes), and are judged as such;
where a gear gives or has play those take steps of 2 ms, too.
"""

from __future__ import annotations

import argparse
import sys

from model.discrepancy.output_error.observation import STEP, step_of_derivatives
from model.effects.library import library
from model.simulation.prepared import LONGEST_STEP as STEP_OF_FITS
from tests.model.simulation.effect_cases import CASES, Bench

SECONDS, EXACT_STEP = 1.3, 1e-5


def main() -> int:
    """0: figures to be read, not targets. Targets are tests (tests/model/simulation/test_effects_integrated.py)."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.effect_integration", description=__doc__)
    parser.add_argument("effects", nargs="*", help="only these")
    only = parser.parse_args().effects
    bench = Bench(SECONDS, EXACT_STEP)
    print("| effect | joint | its own size | error at 1 ms | at 2 ms | of the difference at 7 ms |")
    print("|---|---|---|---|---|---|")
    for case in CASES:
        for joint in (1,) if library()[case.effect].whole_machine else (1, 2, 3):
            if (only and case.effect not in only) or (case.effect, joint) == ("centre_of_mass", 1):
                continue  # along the waist's own axis a centre of mass has no arm
            model = case.model(bench.base, joint)
            size, errors, differences = bench.measure(model, (STEP_OF_FITS, STEP, step_of_derivatives(model)))
            if size == 0.0:
                continue  # gravity asks nothing of an upright waist
            found = (errors[STEP_OF_FITS], errors[STEP], differences[step_of_derivatives(model)])
            cells = [f"{e:.4f} ({100 * e / size:.2f} %)" for e in found]
            where = "–" if library()[case.effect].whole_machine else str(joint)
            print(f"| `{case.effect}` | {where} | {size:.2f} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
