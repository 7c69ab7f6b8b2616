"""Joints that shake faster than torques are compared are told, and what is slow or noise is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
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


def test_a_record_without_frequencies_above_the_cutoff_says_nothing() -> None:
    sound = slide_trace(1, {})
    thin = replace(sound, **{name: getattr(sound, name)[::20] for name in ("time", "position", "drive")})
    assert find_shaking([thin], slide_machine(), 12.0) == ()


def test_a_diagnosis_warns_of_it_first() -> None:
    fitted, held = (shaken(slide_trace(seed, {}, 8.0), 40.0, 1e-3) for seed in (1, 2))
    found = diagnose_torques(base_model(slide_machine()), [fitted], [held])
    warning = next(n for n in found.notes_data if n.kind == "shakes-above-cutoff")
    assert warning.warning
    assert "joint 1 at 40 Hz" in " ".join(found.notes)
