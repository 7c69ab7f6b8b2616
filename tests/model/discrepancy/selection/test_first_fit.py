"""The first fit, of the tolerance parameters alone, also where a strong effect takes it to the verge of instability."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.observation import Observation, Signals, observe
from model.discrepancy.output_error.search import Point
from model.discrepancy.selection.diagnose import _fit_tolerances, _given_point
from model.discrepancy.thresholds import FEEDBACK_SHARE
from tests.model.fitting import imagined

UNSTABLE = "the simulation does not stay finite: the control loop is unstable"


@dataclass(frozen=True)
class Unstable(Observation):
    """An observation whose simulations do not stay finite where `fails` of the feedback share and values says so."""

    fails: Callable[[float, Floats], bool] = lambda _share, _values: False

    def residuals(self, tried: Calibration) -> Signals:
        if self.fails(self.prepared[0].following, tried.values):
            raise SpecError(UNSTABLE)
        return super().residuals(tried)


def given() -> Point:
    """A record, and the model as it was given."""
    return _given_point(*observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=2.0)]))


def unstable(point: Point, fails: Callable[[float, Floats], bool]) -> Point:
    """The point on a record whose simulations fail there."""
    own = point.observation
    return replace(
        point, observation=Unstable(own.machine, own.records, own.deviations, own.unit, own.prepared, fails=fails)
    )


def test_the_fit_starts_from_the_given_model_where_the_closed_loop_has_led_to_instability() -> None:
    begun = given()
    failures = iter([True])  # the first simulation with the full share, from where the closed loop has led
    led_away = unstable(begun, lambda share, _: share == FEEDBACK_SHARE and next(failures, False))
    assert _fit_tolerances(led_away).cost < begun.cost


def test_the_fit_starts_with_the_record_as_feedback_where_the_closed_loop_is_unstable() -> None:
    begun = given()
    assert _fit_tolerances(unstable(begun, lambda share, _: share != FEEDBACK_SHARE)).cost < begun.cost


def test_a_model_that_is_unstable_everywhere_is_refused_with_one_line() -> None:
    with pytest.raises(SpecError, match=UNSTABLE):
        _fit_tolerances(unstable(given(), lambda _share, _values: True))
