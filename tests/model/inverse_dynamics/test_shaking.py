"""Joints that shake faster than torques are compared are told, and what is slow or noise is not."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.shaking import Shaking, find_shaking
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine, slide_trace


def shaken(trace: Trace, hertz: float, size: float) -> Trace:
    """The trace of a slide that shakes by `size` (m)."""
    return replace(trace, position=trace.position + size * np.sin(2 * np.pi * hertz * trace.time)[:, None])


def shaking(*traces: Trace) -> tuple[Shaking, ...]:
    machine = slide_machine()
    return find_shaking(traces, machine, choose_cutoff(traces[:1], machine))


@pytest.mark.parametrize("hertz", [25.0, 40.0, 80.0])
def test_the_frequency_of_a_limit_cycle_is_told(hertz: float) -> None:
    sound = slide_trace(1, {})
    (found,) = shaking(shaken(sound, hertz, 100.0 / (2 * np.pi * hertz) ** 2))
    assert found.joint == 1
    assert found.frequency == pytest.approx(hertz, abs=1.0)
    assert found.factor > 10.0


def test_the_trace_that_shakes_most_is_told() -> None:
    sound = slide_trace(1, {})
    weak, strong = shaken(sound, 25.0, 0.002), shaken(sound, 40.0, 0.004)
    (found,) = shaking(sound, weak, strong)
    assert found.frequency == pytest.approx(40.0, abs=1.0)


def test_a_slow_motion_and_noise_do_not_shake() -> None:
    sound = slide_trace(1, {})
    noise = np.random.default_rng(5).normal(0.0, 1e-4, sound.position.shape)
    assert shaking(sound) == ()
    assert shaking(shaken(sound, 2.0, 0.01)) == ()
    assert find_shaking([replace(sound, position=sound.position + noise)], slide_machine(), 12.0) == ()


@pytest.mark.parametrize("rate", [25.0, 40.0, 40.03])
def test_a_record_without_frequencies_above_the_cutoff_says_nothing(rate: float) -> None:
    sound = slide_trace(1, {})
    time = np.arange(0.0, 16.0, 1.0 / rate)
    assert sound.drive is not None
    position, drive = (np.interp(time, sound.time, s[:, 0])[:, None] for s in (sound.position, sound.drive))
    assert find_shaking([replace(sound, time=time, position=position, drive=drive)], slide_machine(), 12.0) == ()


def test_a_commanded_sweep_does_not_shake_below_a_low_cutoff() -> None:
    """What can be compared counts, and not what the user asked to compare."""
    fitted, held = (shaken(slide_trace(seed, {}, 8.0), 7.0, 0.02) for seed in (1, 2))
    found = diagnose_torques(base_model(slide_machine()), [fitted], [held], TorqueOptions(cutoff=2.0))
    assert not [note for note in found.notes_data if note.kind == "shakes-above-cutoff"]


def test_a_diagnosis_warns_of_it() -> None:
    fitted, held = (shaken(slide_trace(seed, {}, 8.0), 40.0, 1e-3) for seed in (1, 2))
    found = diagnose_torques(base_model(slide_machine()), [fitted], [held])
    assert [note.kind for note in found.notes_data if note.warning] == ["shakes-above-cutoff"]
    assert "joint 1 at 40 Hz" in " ".join(found.notes)
