"""A diagnosis repeats to the bit in another process, whatever order sets have there."""

import os
import subprocess
import sys

PROGRAM = """
from model.discrepancy.workflow import diagnose
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

rubbing = imagined.arm().with_effect("coulomb_friction", (2,), {"torque": 9.0})
found = diagnose(imagined.arm(), [trace_of(rubbing, 12.0)])
assert found.gap.without.numbers, "no number was far off"
print(found.model_copy(update={"seconds": 0.0}).model_dump_json())
"""


def test_a_diagnosis_does_not_depend_on_the_order_of_sets() -> None:
    answers = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for seed in ("0", "1")
    ]
    assert answers[0] == answers[1]
