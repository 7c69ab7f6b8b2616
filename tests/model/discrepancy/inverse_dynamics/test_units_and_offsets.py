"""No answer depends on the unit of the recorded drive; an offset and too short a record are told as what they are."""

from dataclasses import replace

import pytest

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.units import in_unit, recorded

RUBBING = {"coulomb": 6.0, "viscous": 15.0}


def pushed(trace: Trace, force: float) -> Trace:
    """The same record with a constant force that the drive has to bear."""
    assert trace.drive is not None
    return replace(trace, drive=trace.drive + force)


def test_a_fit_of_torques_is_the_same_in_every_unit_of_the_drive() -> None:
    sizes = []
    for factor in (1.0, 1e-2, 1e3):
        model = base_model(in_unit(rigs.slide_machine(), factor)).with_effect("coulomb_friction", (1,))
        traces = [recorded(rigs.slide_trace(1, RUBBING, duration=10.0), factor)]
        found = {p.name: p for p in fit_torques(model, traces, options=FitOptions()).parameters}
        friction = found["joint1.coulomb_friction.torque"]
        sizes.append((friction.model_value, friction.expected_deviation))
    assert sizes[1:] == [pytest.approx(sizes[0], rel=1e-4)] * 2


@pytest.mark.slow
def test_friction_is_named_beside_a_constant_force_which_is_told_as_a_group() -> None:
    """The force correlates over any distance: taken for noise, it would leave next to no independent samples."""
    fitted, held = (pushed(rigs.slide_trace(seed, RUBBING, duration=10.0), 4.0) for seed in (1, 2))
    found = diagnose_torques(base_model(rigs.slide_machine()), [fitted], [held])
    adopted = [s for s in found.steps if s.adopted]
    assert {"coulomb_friction"} <= {s.effect for s in adopted}
    constant = next(s for s in adopted if s.effect != "coulomb_friction" and s.group)
    assert {"base_tilt", "direction_dependent_friction"} <= {c.effect for c in constant.group}


def test_a_tilted_base_is_in_the_group_of_a_constant_force_whatever_its_parameters_cost() -> None:
    """A tilt has two parameters, friction by direction has one: on an axis that slides along x both are the same force,
    and what the second parameter costs is more than the lead that is asked for here."""
    fitted, held = (pushed(rigs.slide_trace(seed, RUBBING, duration=10.0), 4.0) for seed in (1, 2))
    named = ("coulomb_friction", "base_tilt", "direction_dependent_friction")
    asked = TorqueOptions(least_margin=2.0, effects=named)
    found = diagnose_torques(base_model(rigs.slide_machine()), [fitted], [held], asked)
    step = next(s for s in found.steps if s.adopted and s.effect != "coulomb_friction")
    evidence = {c.effect: c.evidence for c in step.group}
    assert set(evidence) == {"base_tilt", "direction_dependent_friction"}, found.summary
    assert max(evidence.values()) - min(evidence.values()) > asked.least_margin


def test_an_effect_that_lacks_evidence_alone_is_suspected() -> None:
    trace = rigs.slide_trace(1, {"coulomb": 6.0}, duration=4.0)
    strict = TorqueOptions(least_evidence=2000.0, effects=("coulomb_friction", "payload"))
    found = diagnose_torques(base_model(rigs.slide_machine()), [trace], options=strict)
    assert found.verdict == "suspected", found.summary
    assert found.suspicion is not None
    assert found.suspicion.effect == "coulomb_friction"
    assert found.suspicion.evidence < found.suspicion.needed == pytest.approx(2000.0, rel=1e-3)
    assert found.suspicion.seconds >= 5.0
    assert found.summary.startswith("Suspected: Coulomb friction on joint 1, evidence ")
    assert Diagnosis.model_validate_json(found.model_dump_json()) == found
