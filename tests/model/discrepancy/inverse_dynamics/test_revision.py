"""How candidates compete, and effects that are looked for once more with all others in place."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.machine import Machine
from daq.contracts.progress import Never, silent
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine import holdout
from model.discrepancy.engine.candidate import RARE, Fitted
from model.discrepancy.engine.exchange import challengers
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.judging import compare
from model.discrepancy.engine.search import prefer_fewer_joints, prefer_shorter_laws, search
from model.discrepancy.engine.step_record import record_step
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.explanation.answer_words import what_is_left
from model.discrepancy.inverse_dynamics.candidates import take_back
from model.discrepancy.inverse_dynamics.case import torque_case
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.readings import choose_cutoff, torque_noise
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.repeats import TorqueNoise
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.searches import sliding


def adopted(found: Diagnosis) -> set[tuple[str | None, tuple[int, ...]]]:
    return {(s.effect, s.joints) for s in found.steps if s.adopted}


def slide(effects: tuple[str, ...], **hidden: float) -> Diagnosis:
    options = TorqueOptions(effects=effects, least_evidence=10.0)
    training, held_out = (rigs.slide_trace(seed, hidden) for seed in (1, 2))
    return diagnose_torques(base_model(rigs.slide_machine()), [training], [held_out], options)


@pytest.mark.slow
def test_effects_of_which_each_takes_a_third_are_named_together() -> None:
    hidden = {"coulomb": 6.0, "hum": 8.5, "spring": 120.0}
    found = slide(("coulomb_friction", "periodic_disturbance", "spring_torque"), **hidden)
    assert adopted(found) == {(n, (1,)) for n in ("coulomb_friction", "periodic_disturbance", "spring_torque")}


def test_the_gap_shrinks_with_every_step() -> None:
    found = slide(("coulomb_friction", "periodic_disturbance"), coulomb=6.0, hum=8.5)
    gap = found.gap
    assert [s.kind for s in gap.stages] == ["given", "effect", "effect", "refitted"]
    for kind, noisier in (("fitted", 1.05), ("held_out", 1.2)):
        given, first, second, whole = (getattr(s, kind)[0] or 0.0 for s in gap.stages)
        alone = getattr(gap.without, kind)[0] or 0.0
        assert given > 1.2 * first > 1.2 * 1.2 * second > 0.0
        assert noisier * second > whole > 0.0, "the numbers as the file states them leave hardly more"
        assert alone > 1.2 * first, "numbers alone do not do it"
    assert "Without the effect, fitted numbers alone leave" in gap.without.text


def candidate(effect: str, flow: Workflow, evidence: float, told: float = 0.0) -> Fitted:
    return Fitted(
        effect, (1,), flow.found.model, (), flow.found.first, evidence=evidence, told=told, told_compared=told
    )


def test_the_file_is_trusted_against_an_effect_but_not_against_any_evidence() -> None:
    flow = sliding({"coulomb": 8.0}, TorqueOptions())
    load = candidate("payload", flow, 40.0)
    assert candidate("wrong_resistance", flow, 40.0).log_odds < load.log_odds
    assert candidate("wrong_resistance", flow, 41.0 + RARE).log_odds > load.log_odds
    assert candidate("gear_loss", flow, 30.0, told=15.0).log_odds > load.log_odds


def test_drag_is_rare_without_viscous_friction() -> None:
    flow = sliding({"coulomb": 8.0}, TorqueOptions())
    alone = candidate("quadratic_drag", flow, 40.0)
    beside = replace(alone, model=flow.found.model.with_effect("viscous_friction", (1,)))
    assert beside.log_odds - alone.log_odds == pytest.approx(RARE)


@pytest.mark.slow
def test_drag_that_acts_alone_is_named_alone() -> None:
    found = slide(("viscous_friction", "quadratic_drag", "coulomb_friction"), drag=80.0)
    assert adopted(found) == {("quadratic_drag", (1,))}


def test_rivals_of_a_step_are_fitted_in_its_place() -> None:
    """Coulomb friction acts, and another law was taken for it before the disturbance was known."""
    effects = ("coulomb_friction", "gear_loss", "periodic_disturbance")
    flow = sliding({"coulomb": 6.0, "hum": 8.5}, TorqueOptions(effects=effects, least_evidence=10.0))
    before, findings = flow._searched()
    right, wrong = (next(f for f in findings.fitted if f.effect == name) for name in effects[:2])
    assert challengers(right, findings.fitted)[0] is right
    taken = record_step(before, findings, compare(before, wrong), ())
    flow.found = replace(before.take(wrong), steps=(taken,))
    flow.places[0] = (wrong, right)
    flow.found = flow._adopt(*flow._searched())
    assert [s.effect for s in flow.found.steps] == ["gear_loss", flow.found.steps[1].effect]
    flow._exchange()
    assert flow.found.steps[0].effect == "coulomb_friction"


def test_a_joint_that_brings_little_is_not_named_with_the_others() -> None:
    flow = sliding({"coulomb": 8.0}, TorqueOptions())
    both, one, little = (
        replace(candidate("gear_loss", flow, evidence), joints=joints)
        for evidence, joints in ((100.0, (1, 2)), (95.0, (1,)), (60.0, (2,)))
    )
    other = candidate("backlash", flow, 97.0)
    assert [f.joints for f in prefer_fewer_joints([both, other, one, little], 12.0)] == [(1,), (1, 2), (1,), (2,)]
    assert prefer_fewer_joints([replace(both, evidence=110.0), one], 12.0)[0].joints == (1, 2)
    assert prefer_fewer_joints([other, both, one], 12.0)[0] is other
    assert prefer_fewer_joints([], 12.0) == []


def test_what_held_out_records_say_of_fits_is_counted_in_the_same_samples() -> None:
    """A fit as good as another one gets the same evidence, whatever the correlation of its own residual."""
    flow = sliding({"coulomb": 8.0}, TorqueOptions(effects=("coulomb_friction", "stribeck_friction")))
    found = search(flow.found.first, flow.case, lambda _: 0.0, lambda *_: None, Never()).fitted
    coulomb = next(f.fit for f in found if f.effect == "coulomb_friction")
    other = next(f.fit for f in found if f.effect != "coulomb_friction")
    alone = holdout.evidence(flow.case, flow.found.first, [coulomb])
    both = holdout.evidence(flow.case, flow.found.first, [coulomb, other, coulomb])
    assert both[0] == both[2]
    assert both[0].compared > 30.0
    assert both[0].compared >= both[1].compared
    assert both[0].alone == alone[0].alone == alone[0].compared
    assert holdout.evidence(flow.case, flow.found.first, []) == []


@pytest.mark.slow
def test_a_weakened_magnet_takes_back_what_the_constants_had_taken() -> None:
    traces = [rigs.bench_trace(seed, {"constant": 0.042, "back_emf": 0.042}) for seed in (1, 2)]
    model = base_model(weak_bench())
    cutoff = choose_cutoff(traces, model.machine)
    fitted, held = (recorded_motions([t], model.machine, cutoff) for t in traces)
    noise = TorqueNoise(torque_noise(model, traces, cutoff), fitted, np.zeros(1, dtype=bool))
    case = torque_case(model, fitted, held, noise, TorqueOptions())
    flow = Workflow(case, 16.0, silent, Never())
    wider = model.with_effect("weakened_magnet", (1,))
    own = [p for p in wider.parameters if p.effect == "weakened_magnet"]
    begun = take_back("weakened_magnet", own, flow.found.first)
    assert begun[own[0].name] == pytest.approx(0.16, abs=0.03)
    for part in ("torque_constant", "back_emf_constant"):
        assert begun[f"joint1.motor.{part}"] == pytest.approx(0.05, rel=0.03)
    assert take_back("viscous_friction", own, flow.found.first) == {}
    found = diagnose_torques(model, traces[:1], traces[1:])
    assert adopted(found) == {("weakened_magnet", (1,))}, found.summary


def weak_bench() -> Machine:
    """The bench with both constants of its magnet stated to 2 %."""
    drive = rigs.bench_machine().model_dump()
    motor = drive["joints"][0]["drive"]
    motor["torque_constant"]["deviation"] = motor["back_emf_constant"]["deviation"] = 0.001
    return Machine.model_validate(drive)


class Imitating(Fitted):
    """A candidate that follows the torque of every other one."""

    def imitates(self, other: Fitted, before: Fit) -> bool:
        return True


def test_a_longer_law_that_imitates_a_shorter_one_is_not_named_for_a_little_more_evidence() -> None:
    flow = sliding({"coulomb": 8.0}, TorqueOptions())
    scale = candidate("potentiometer_gain", flow, 95.0)
    bent = Imitating("potentiometer_nonlinearity", (1,), flow.found.model, (), flow.found.first, evidence=100.0)
    weight = candidate("payload", flow, 99.0)
    assert prefer_shorter_laws([bent, scale], flow.found.first, 12.0) == [scale, bent]
    assert prefer_shorter_laws([bent, scale], flow.found.first, 4.0) == [bent, scale]
    assert prefer_shorter_laws([weight, scale], flow.found.first, 12.0) == [weight, scale]
    assert prefer_shorter_laws([bent, replace(scale, joints=(2,))], flow.found.first, 12.0)[0] is bent
    assert prefer_shorter_laws([], flow.found.first, 12.0) == []


# ---- Where torques are missing most.


@pytest.fixture(scope="module")
def rubbing() -> Workflow:
    return sliding({"coulomb": 8.0}, TorqueOptions(effects=("coulomb_friction",)))


def test_friction_at_a_place_is_seen_where_it_is_and_is_unknown() -> None:
    """Forwards it pushes back, backwards it pushes forwards: its mean over both directions is nothing."""
    traces = [rigs.slide_trace(seed, {"tight": 3.0}, duration=8.0) for seed in (1, 2)]
    found = diagnose_torques(
        base_model(rigs.slide_machine()), traces[:1], traces[1:], TorqueOptions(effects=("spring_torque",))
    )
    assert found.verdict == "unknown-effect", found.summary
    (shape,) = found.remaining
    assert (shape.against, shape.against_motion) == ("position", True)
    assert shape.explained > 0.4
    place = max(zip(shape.centres, shape.torque, strict=True), key=lambda b: b[1] or 0.0)
    assert place[0] == pytest.approx(rigs.SLIDE["tight_at"], abs=0.03)
    assert place[1] > 0.5
    assert what_is_left(found.remaining).startswith("friction at joint 1 of ")


def test_the_joint_of_the_largest_residual_is_named(rubbing: Workflow) -> None:
    where = rubbing.case.where(rubbing.found.now)
    assert (where.joint, where.worst.joint, where.largest) == (1, 1, None)
    sizes = np.sqrt(rubbing.found.now.squares)
    assert where.worst.rms == pytest.approx(sizes[0])
    assert where.worst.ratio == pytest.approx(sizes[0] / rubbing.case.noise[0])
