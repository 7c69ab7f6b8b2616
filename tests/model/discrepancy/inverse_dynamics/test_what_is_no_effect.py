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
from model.discrepancy.excitation import own_frequencies
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.starts import narrowed
from model.discrepancy.inverse_dynamics.step_record import excess_removed
from model.discrepancy.options import TorqueOptions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs


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
    place: Any = SimpleNamespace(positions=dwelling)
    bounded = narrowed(rest, place)
    assert (bounded.low, bounded.high) == (pytest.approx(0.1, abs=0.01), pytest.approx(0.99))
    hardly: Any = SimpleNamespace(positions=np.append(np.linspace(0.0, 1.0, 3), np.full(100, 1.0)))
    assert narrowed(rest, hardly).low == narrowed(rest, hardly).high == pytest.approx(0.99)


def test_a_drive_in_another_unit_than_the_machine_files_is_refused() -> None:
    trace = rigs.bench_trace(1, {})
    amperes = replace(trace, record=trace.record.model_copy(update={"drive_unit": "A"}))
    with pytest.raises(TraceError, match=r"the drive is in A, that of .* in V"):
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
    monkeypatch.setattr(holdout, "relative_torque_error", lambda *_: next(left))
    found = of_slide(rigs.slide_trace(1, {"coulomb": 8.0}))
    (note,) = (note for note in found.notes_data if note.kind == "torque-left")
    assert (found.verdict, note.warning) == (verdict, doubted)
    assert ("that is more than there is" in found.notes[list(found.notes_data).index(note)]) == doubted


def test_times_in_another_unit_are_said_to_be_that() -> None:
    trace = rigs.slide_trace(1, {})
    with pytest.raises(SpecError, match="times are in s, positions in rad or m"):
        of_slide(replace(trace, time=1000.0 * trace.time))
