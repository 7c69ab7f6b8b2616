"""Held-out traces begin where they begin, whatever is known of those fitted to."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.holdout import hold_out
from model.discrepancy.output_error.observation import Observation, Signals, observe
from model.discrepancy.output_error.search import Point, point_at
from model.machine_model.model import Model
from model.machine_model.parameter import Kind
from tests.model.fitting import imagined

COUNT = 1 / 3000
"""rad: about what a sensor resolves."""
HERTZ, SIZE = 1.7, 4.0
"""Of a disturbance on joint 2, Hz and N·m."""


def begun(traces: int, start: float) -> Point:
    """The arm's own model on that many fitted traces, each said to begin `start` rad off."""
    observation, given = observe(imagined.arm(), imagined.traces(imagined.arm(), traces, seconds=3.0))
    values = [start if u.kind is Kind.INITIAL_POSITION else u.start for u in given.unknowns]
    return point_at(observation, given.at(np.array(values)))


@pytest.mark.parametrize("fitted", [1, 3])
def test_the_floor_of_held_out_traces_does_not_depend_on_the_number_of_fitted_ones(fitted: int) -> None:
    held = hold_out(imagined.arm(), [imagined.trace(imagined.arm(), seconds=3.0, seed=5)])
    assert held is not None
    floor = held.floor(begun(fitted, 0.0))
    assert np.all((floor > 0.1 * COUNT) & (floor < 3 * COUNT))
    assert np.array_equal(held.floor(begun(fitted, 40 * COUNT)), floor)


def humming(phase: float, size: float = SIZE) -> Model:
    """The arm with a disturbance that a record meets at a phase, rad."""
    values = {"sine": size * np.cos(phase), "cosine": size * np.sin(phase), "frequency": HERTZ}
    return imagined.arm().with_effect("periodic_disturbance", (2,), values)


def found(model: Model) -> Point:
    """What a fit to a record of that very arm would lead to."""
    return point_at(*observe(model, [imagined.trace(model, seconds=6.0)]))


@pytest.fixture(scope="module")
def met() -> Point:
    """Of an arm whose fitted record meets the disturbance at phase 0."""
    return found(humming(0.0))


def left_on(point: Point, *phases: float, size: float = SIZE) -> list[np.ndarray]:
    """Root mean squares (n,) of what a point leaves of held-out records that meet the disturbance at those phases, in
    floors of the first."""
    traces = [imagined.trace(humming(p, size), k, seconds=8.0, seed=6) for k, p in enumerate(phases)]
    held = hold_out(imagined.arm(), traces)
    assert held is not None
    floor = held.floor(point)
    shown = zip(held.residuals(point), held.observation.records, strict=True)
    return [np.sqrt(np.mean(residual[record.runs[0]] ** 2, axis=0)) / floor for residual, record in shown]


@pytest.mark.parametrize("phase", [1.6, pytest.param(3.1, marks=pytest.mark.slow)])
def test_a_held_out_record_may_meet_a_disturbance_at_another_phase(met: Point, phase: float) -> None:
    (left,) = left_on(met, phase)
    assert np.all(left < 1.1)


def test_every_held_out_record_has_a_phase_of_its_own(met: Point) -> None:
    for left in left_on(met, 2.0, 5.0):
        assert np.all(left < 1.15)


def test_a_disturbance_does_not_vanish_from_records_that_do_not_show_it(met: Point) -> None:
    (left,) = left_on(met, 1.0, size=0.0)
    assert left[1] > 2.0
    (plain,) = left_on(found(imagined.arm()), 1.0, size=0.0)
    assert np.all(plain < 1.1)


def test_a_held_out_record_of_bent_potentiometers_begins_where_its_readings_do() -> None:
    """Its posture at the start is first taken from potentiometers that do not bend: a dozen counts off."""
    bent = imagined.arm().with_effect("potentiometer_nonlinearity", (1, 2, 3), {"bend_1": 0.011, "bend_3": -0.008})
    point = found(bent)
    for number in range(3):
        held = hold_out(imagined.arm(), [imagined.trace(bent, number, seconds=6.0, seed=6)])
        assert held is not None
        (residual,), (record,) = held.residuals(point), held.observation.records
        left = np.sqrt(np.mean(residual[record.runs[0]] ** 2, axis=0)) / held.floor(point)
        assert np.all(left < 1.15)


@dataclass(frozen=True)
class RunningAway(Observation):
    """An observation whose simulations stay finite only where they follow most of the record."""

    def residuals(self, tried: Calibration) -> Signals:
        found = super().residuals(tried)
        return found if self.prepared[0].following > 0.7 else tuple(np.full_like(f, np.nan) for f in found)


def test_a_held_out_simulation_that_runs_away_follows_the_record_more() -> None:
    held = hold_out(imagined.arm(), [imagined.trace(imagined.arm(), seconds=2.0, seed=6)])
    assert held is not None
    own = held.observation
    away = RunningAway(own.machine, own.records, own.deviations, own.unit, own.prepared)
    assert not np.isfinite(away.residuals(begun(1, 0.0))[0]).any()
    assert all(np.isfinite(left).all() for left in replace(held, observation=away).residuals(begun(1, 0.0)))
