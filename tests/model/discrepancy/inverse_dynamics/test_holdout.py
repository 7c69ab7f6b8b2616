"""Records that were not fitted to meet a disturbance at a phase of their own."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.holdout import held_out_squares, share_removed
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motions
from model.machine_model.model import Model, base_model
from tests.model.discrepancy.inverse_dynamics import rigs

CUTOFF = 8.0


def records(*traces: Trace) -> tuple[RecordedMotion, ...]:
    return recorded_motions(traces, rigs.slide_machine(), CUTOFF)


def later(trace: Trace, samples: int) -> Trace:
    """The record as if it had begun later."""
    signals = {n: getattr(trace, n)[samples:] for n in ("position", "drive")}
    return replace(trace, time=trace.time[samples:] - trace.time[samples], **signals)


def humming(size: float) -> Model:
    """The rig with the disturbance that `rigs` hides, as a fit to a record from its beginning would have it."""
    values = {"sine": size, "cosine": 0.0, "frequency": rigs.SLIDE["hertz"]}
    return base_model(rigs.slide_machine()).with_effect("periodic_disturbance", (1,), values)


@pytest.fixture(scope="module")
def hum() -> Trace:
    return rigs.slide_trace(1, {"hum": 3.0}, duration=8.0)


def test_a_record_may_begin_at_any_phase(hum: Trace) -> None:
    step = float(np.median(np.diff(hum.time)))
    whole = records(hum)
    without = held_out_squares(base_model(rigs.slide_machine()), {}, whole)
    starts = [round(share / rigs.SLIDE["hertz"] / step) for share in (0.25, 0.5, 0.8)]
    for others in (whole, *(records(later(hum, k)) for k in starts), records(hum, later(hum, starts[1]))):
        assert held_out_squares(humming(3.0), {}, others)[0] < 0.05 * without[0]


def test_a_disturbance_does_not_vanish_from_a_record_that_does_not_show_it() -> None:
    quiet = records(rigs.slide_trace(1, {}, duration=8.0))
    without = held_out_squares(base_model(rigs.slide_machine()), {}, quiet)
    assert held_out_squares(humming(3.0), {}, quiet)[0] > without[0] + 0.5 * 3.0**2 / 2


def test_held_out_records_speak_for_an_effect_that_is_there_and_not_for_one_that_is_not() -> None:
    told = {}
    for coulomb in (6.0, 0.0):
        traces = [rigs.slide_trace(seed, {"coulomb": coulomb}, duration=6.0) for seed in (1, 2)]
        options = TorqueOptions(effects=("coulomb_friction",), least_evidence=-1e6, least_share=0.0)
        found = diagnose_torques(base_model(rigs.slide_machine()), traces[:1], traces[1:], options)
        told[coulomb] = found.steps[0].evidence_held_out if found.steps else None
    assert told[6.0] is not None
    assert told[6.0] > 100.0
    assert told[0.0] is None or told[0.0] < 5.0


def test_a_held_out_record_that_tells_nothing_of_a_joint_confirms_nothing() -> None:
    """A drive at a limit all the time: nothing is left there, with an effect or without, since nothing is known."""
    fitted_before, fitted_after = np.array([4.0, 1.0]), np.array([1.0, 1.0])
    assert share_removed(fitted_before, fitted_after, np.array([0.0, 1.0]), np.array([0.0, 1.0])) == 0.0
    assert share_removed(fitted_before, fitted_after, np.array([2.0, 1.0]), np.array([0.5, 1.0])) == pytest.approx(0.75)
