"""A number of the machine that is far from its file, and what stands for it."""

import pytest

from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs


def of_bench(constant: float) -> Diagnosis:
    """The motor bench with a magnet of this torque constant, N·m/A: 0.05 stated to 10 %, its back-EMF to 2 %."""
    stated = rigs.bench_machine().model_dump()
    drive = stated["joints"][0]["drive"]
    drive["resistance"].update(deviation=0.2, low=0.1)
    drive["torque_constant"].update(deviation=0.005, low=0.001)
    traces = [
        rigs.bench_trace(seed, {"resistance": 2.3, "constant": constant, "back_emf": constant}) for seed in (1, 2)
    ]
    return diagnose_torques(base_model(Machine.model_validate(stated)), traces[:1], traces[1:])


@pytest.mark.parametrize(("constant", "weaker"), [pytest.param(0.045, 0.1, marks=pytest.mark.slow), (0.0465, None)])
def test_a_magnet_is_weakened_from_four_deviations_of_its_better_known_constant(
    constant: float, weaker: float | None
) -> None:
    """10 % and 7 % weaker are 4.7 and 3.4 deviations of the back-EMF constant."""
    found = of_bench(constant)
    named = [s for s in found.steps if s.adopted]
    assert [s.effect for s in named] == ([] if weaker is None else ["weakened_magnet"]), found.summary
    for step in named:
        (loss,) = step.parameters.values()
        assert loss.value == pytest.approx(weaker, abs=0.01)
