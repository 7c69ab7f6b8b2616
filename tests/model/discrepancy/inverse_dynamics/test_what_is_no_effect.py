"""What a lab's own rig shows and no effect is: the ends of a record, the motion's own frequencies, friction that fades
at no recorded speed, sizes at their bounds; and what is said of records that do not suit their file."""

from dataclasses import replace
from itertools import cycle
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.holdout import excess_removed
from model.discrepancy.excitation import own_frequencies
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.starts import narrowed
from model.discrepancy.options import TorqueOptions
from model.fitting.options import FitOptions
from model.inverse_dynamics import repeats
from model.inverse_dynamics.fit import fit_torques
from model.inverse_dynamics.repeats import LEAST_OF_TORQUE
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.units import in_unit, recorded


def of_slide(*traces: Trace, options: TorqueOptions | None = None) -> Diagnosis:
    return diagnose_torques(base_model(rigs.slide_machine()), traces[:1], traces[1:], options)


def test_records_that_begin_and_end_in_motion_leave_noise() -> None:
    """A low-pass lacks samples beyond the ends; one period of the cutoff there left 1.6 times noise."""
    (error,) = of_slide(*(rigs.slide_trace(seed, {}) for seed in (1, 2))).rmse_fit
    assert error.after < 1.25 * error.floor


def test_a_sine_of_several_is_a_frequency_of_the_motion() -> None:
    time = np.arange(0.0, 30.0, 0.01)
    rates, sizes = np.array([0.11, 0.37, 0.8, 1.9]), np.array([1.0, 0.6, 0.6, 0.32])
    speed: Floats = (sizes * np.cos(2 * np.pi * time[:, None] * rates)).sum(axis=1, keepdims=True)
    asked = np.array([0.37, 0.8, 1.9, 0.55, 1.2, 2.4])
    assert own_frequencies(asked, [speed], 0.01).tolist() == [True] * 3 + [False] * 3


def test_noise_has_no_frequency_of_its_own() -> None:
    draw = np.random.default_rng(3)
    speed: Floats = np.cumsum(draw.normal(size=(3000, 1)), axis=0)
    assert not own_frequencies(np.arange(0.2, 5.0, 1 / 30), [speed - speed.mean()], 0.01).any()


def test_friction_that_fades_beyond_the_recorded_speeds_is_coulomb_friction() -> None:
    found = of_slide(*(rigs.slide_trace(seed, {"coulomb": 8.0}) for seed in (1, 2)))
    (step,) = (s for s in found.steps if s.adopted)
    assert (step.effect, step.group) == ("coulomb_friction", ()), found.summary
    assert "stribeck_friction" not in {c.effect for c in step.candidates if c.refitted}


def test_a_share_of_held_out_variance_is_of_the_joints_that_an_effect_changes() -> None:
    noise = np.array([0.1, 0.1])
    fitted = (np.array([0.5, 0.5]), np.array([0.5, 0.01]))
    removed = excess_removed(noise, fitted, np.array([0.5, 0.5]), np.array([0.5, 0.01]))
    assert removed == pytest.approx(1.0)
    assert excess_removed(noise, (fitted[0], fitted[0]), np.array([0.5, 0.5]), np.array([0.5, 0.01])) is None


def test_a_spring_on_one_side_is_taut_for_a_part_of_the_travel() -> None:
    """Where a joint dwells at the end of its motion, a stiff one for the last thousandth of it follows friction."""
    model = base_model(rigs.bench_machine()).with_effect("one_sided_spring", (1,))
    rest = model.parameter("joint1.one_sided_spring.rest")
    dwelling = np.concatenate([np.linspace(0.0, 1.0, 100), np.full(100, 1.0)])
    place: Any = SimpleNamespace(positions=dwelling, travel=1.0)
    bounded = narrowed(rest, place)
    assert (bounded.low, bounded.high) == (pytest.approx(0.1, abs=0.01), pytest.approx(0.99))
    hardly: Any = SimpleNamespace(positions=np.append(np.linspace(0.0, 1.0, 3), np.full(100, 1.0)), travel=1.0)
    assert narrowed(rest, hardly).low == narrowed(rest, hardly).high == pytest.approx(0.99)


def test_a_drive_in_another_unit_than_the_machine_files_is_refused() -> None:
    trace = rigs.bench_trace(1, {})
    amperes = replace(trace, record=trace.record.model_copy(update={"drive_unit": "A"}))
    with pytest.raises(TraceError, match=r"the drive is in A, but that of .* in V"):
        diagnose_torques(base_model(rigs.bench_machine()), [amperes])


def test_a_record_that_nothing_drives_is_a_coast() -> None:
    """Free of its drive, the slide is slowed down by its friction."""
    trace = rigs.slide_trace(1, {"coulomb": 8.0})
    coast = replace(trace, drive=np.zeros_like(trace.drive))
    assert not any(note.kind == "torque-left" for note in of_slide(coast).notes_data)


def test_a_record_that_does_not_suit_its_file_is_doubted_first() -> None:
    trace = rigs.slide_trace(1, {})
    found = of_slide(replace(trace, drive=-trace.drive))
    (note,) = (note for note in found.notes_data if note.kind == "torque-left")
    assert (note.warning, found.verdict) == (True, "partly")
    assert "signs" in found.notes[list(found.notes_data).index(note)]


@pytest.mark.parametrize(
    ("shares", "verdict", "doubted"), [((0.9, 1.3, 1.2), "partly", True), ((1.3, 0.9, 0.2), "named", False)]
)
def test_no_effect_is_named_beside_more_torque_than_there_is(
    monkeypatch: pytest.MonkeyPatch, shares: tuple[float, float, float], verdict: str, doubted: bool
) -> None:
    """shares: left of the recorded torque by the model as given, with its numbers fitted, and at the end."""
    left = cycle(shares)
    monkeypatch.setattr(TorqueCase, "torque_left", lambda *_: next(left))
    found = of_slide(rigs.slide_trace(1, {"coulomb": 8.0}))
    (note,) = (note for note in found.notes_data if note.kind == "torque-left")
    assert (found.verdict, note.warning) == (verdict, doubted)
    assert ("that is more than there is" in found.notes[list(found.notes_data).index(note)]) == doubted


def test_times_in_another_unit_are_said_to_be_that() -> None:
    trace = rigs.slide_trace(1, {})
    with pytest.raises(SpecError, match="times must be in s, positions in rad or m"):
        of_slide(replace(trace, time=1000.0 * trace.time))


# ---- When an effect that has the evidence is taken, and when it is not.


def test_an_effect_that_explains_less_than_half_of_what_stays_unexplained_is_taken_back() -> None:
    """A force in proportion to position times speed is no known law. A disturbance in time takes a little of it off
    both records, with evidence in plenty."""

    def drag(trace: Trace) -> Floats:
        middle = trace.position - trace.position.mean()
        return np.asarray(1.3 * middle * np.gradient(trace.position[:, 0], trace.time)[:, None])

    records = [rigs.slide_trace(seed, {}) for seed in (1, 2)]
    found = of_slide(*(replace(trace, drive=trace.drive + drag(trace)) for trace in records))
    assert not any(step.adopted for step in found.steps)
    (refusal,) = (step.refusal for step in found.steps)
    assert (refusal.kind, refusal.numbers["share"] < 0.5) == ("less-than-rest", True)


FRICTION = ("coulomb_friction",)


def slide(training: Trace, held_out: Trace | None = None, options: TorqueOptions | None = None) -> Diagnosis:
    other = [] if held_out is None else [held_out]
    return diagnose_torques(base_model(rigs.slide_machine()), [training], other, options)


def traces(**hidden: float) -> tuple[Trace, Trace]:
    return rigs.slide_trace(1, hidden), rigs.slide_trace(2, hidden)


def test_viscous_friction_that_falls_with_speed_is_two_effects_and_partly_one() -> None:
    """What viscous friction leaves is a function of its own force: another law of speed acts beside it."""
    both = traces(viscous=60.0, drag=-25.0)
    found = slide(*both)
    assert found.verdict == "named", found.summary
    (drag,) = (step for step in found.steps if step.effect == "quadratic_drag")
    assert {"viscous_friction", "quadratic_drag"} <= {step.effect for step in found.steps if step.adopted}
    assert all(step.group == () for step in found.steps)
    assert drag.parameters["joint1.quadratic_drag.coefficient"].value == pytest.approx(-25.0, rel=0.05)
    alone = slide(*both, TorqueOptions(effects=("viscous_friction",)))
    assert (alone.verdict, [step.effect for step in alone.steps if step.adopted]) == ("partly", ["viscous_friction"])


@pytest.mark.parametrize(("coulomb", "suspected"), [(0.002, False), (0.014, True)])
def test_a_suspicion_needs_a_twentieth_of_what_is_left(coulomb: float, suspected: bool) -> None:
    """Both have more evidence than a suspicion asks for: a force so small explains little of what noise leaves."""
    found = slide(*traces(coulomb=coulomb), TorqueOptions(effects=FRICTION, least_evidence=1e6))
    assert found.candidates[0].effect == "coulomb_friction"
    assert found.candidates[0].evidence > 12.0
    assert (found.suspicion is not None) is suspected, found.summary
    assert found.verdict == ("suspected" if suspected else "nothing-significant")


@pytest.mark.parametrize("share", [LEAST_OF_TORQUE, 0.05])
def test_noise_is_a_share_of_the_torque_of_the_drive_at_least(share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(repeats, "LEAST_OF_TORQUE", share)
    training, held_out = traces()
    assert training.drive is not None
    found = slide(training, held_out, TorqueOptions(effects=FRICTION))
    floor, least = found.rmse_fit[0].floor, share * float(np.sqrt(np.mean(training.drive**2)))
    assert floor >= 0.95 * least
    if share > 0.01:
        assert floor == pytest.approx(least, rel=0.05)


def asking_for_more(trace: Trace) -> Trace:
    """The record of a drive that asked for its largest force, 1.3 times what acted, wherever much was needed."""
    limit = float(np.quantile(np.abs(trace.drive), 0.93))
    at = np.abs(trace.drive) > limit
    return replace(trace, drive=np.where(at, np.sign(trace.drive) * 1.3 * limit, trace.drive))


def test_what_a_drive_at_a_limit_does_not_give_is_no_effect_and_is_told() -> None:
    training, held_out = (asking_for_more(trace) for trace in traces())
    found = slide(training, held_out)
    assert not any(s.adopted for s in found.steps), found.summary
    assert found.verdict == "nothing-significant", found.summary
    (note,) = [note for note in found.notes_data if note.kind == "drive-at-limit"]
    ((joint, share),) = note.values["shares"]
    assert joint == 1
    assert share == pytest.approx(0.07, abs=0.02)
    assert any("stands at its largest value" in text and "of joint 1's time" in text for text in found.notes)


# ---- No answer depends on the unit of the recorded drive; an offset and too short a record are told as what they are.

RUBBING = {"coulomb": 6.0, "viscous": 15.0}


def pushed(trace: Trace, force: float) -> Trace:
    """The same record with a constant force that the drive has to bear."""
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
    assert found.suspicion.effect == "coulomb_friction"
    assert found.suspicion.evidence < found.suspicion.needed == pytest.approx(2000.0, rel=1e-3)
    assert found.suspicion.seconds >= 5.0
    assert found.summary.startswith("Suspected: Coulomb friction on joint 1, evidence ")
    assert Diagnosis.model_validate_json(found.model_dump_json()) == found
