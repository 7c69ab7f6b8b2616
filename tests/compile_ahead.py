"""Compiles what all workers of the tests need, once: `python -m tests.compile_ahead`, as `make test-thorough` does.

Bytecode of the tests with their assertions rewritten, and the machine code of the simulation. What is missing here, the
first test that needs it compiles.
"""

import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import Model, base_model
from model.simulation.batch import LANES_FROM
from model.simulation.inputs import inputs_of
from model.simulation.simulate import sensitivities, simulate, simulate_many
from tests.model.simulation.records import ramp_trace, trace_of

ROOT = Path(__file__).parents[1]


def models() -> list[Model]:
    """The three ways to simulate: the arm of rods, the same with a transmission that gives, and any chain."""
    arm = base_model(load_machine("ma2000"))
    axis = base_model(load_machine(str(ROOT / "examples" / "single_axis.toml")))
    return [arm, arm.with_effect("joint_compliance", (2,), {"compliance": 1e-3}), axis]


def compile_simulation() -> None:
    """Real and dual numbers of each, and lanes."""
    for model in models():
        trace = (
            ramp_trace(model.machine)
            if len(model.machine.modelled_joints) > 1
            else trace_of(np.full((100, 1), 0.1), period=0.005)
        )
        inputs = inputs_of(trace, model.machine)
        simulate(model, inputs)
        sensitivities(model, inputs, [model.parameters[0]])
        simulate_many(model, [inputs], {model.parameters[0].name: np.full(LANES_FROM, model.parameters[0].value)})


def main() -> int:
    """Collect the tests, then compile; 0 where both could be done."""
    with redirect_stdout(StringIO()) as said:
        code = pytest.main(["--collect-only", "-q", "-p", "no:cacheprovider"])
    if code != pytest.ExitCode.OK:
        sys.stderr.write(said.getvalue())
        return int(code)
    compile_simulation()
    return 0


if __name__ == "__main__":
    sys.exit(main())
