"""A run without a compiler is the run that is compiled: for stepping through it, and for trying faults in it."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.simulation.specialised import AnyChain, ClosedForm, Flexible, uncompiled
from tests.model.simulation.records import ramp_inputs

SIMULATE = """
from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.records import ramp_inputs
model = base_model(load_machine("ma2000"))
for general in (False, True):
    print(*simulate(model, ramp_inputs(model.machine, duration=0.3), Options(general=general)).position.ravel())
"""


def test_the_type_of_a_tag_chooses_in_python_what_it_chooses_in_the_compiler() -> None:
    def choose(kind: Any, _x: int) -> Any:
        return (lambda _kind, x: 10 * x) if kind.instance_class is AnyChain else (lambda _kind, x: x + 1)

    assert uncompiled(choose, AnyChain(0), 3) == 30
    assert uncompiled(choose, ClosedForm(0), 3) == uncompiled(choose, Flexible(0), 3) == 4


@pytest.mark.slow
def test_a_run_in_python_is_the_compiled_run() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SIMULATE],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        check=True,
    )
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine, duration=0.3)
    for line, general in zip(done.stdout.splitlines(), (False, True), strict=True):
        compiled = simulate(model, inputs, Options(general=general)).position
        np.testing.assert_allclose(np.array(line.split(), dtype=float), compiled.ravel(), rtol=1e-9)
        assert np.ptp(compiled, axis=0).max() > 0.01, "it moves"
