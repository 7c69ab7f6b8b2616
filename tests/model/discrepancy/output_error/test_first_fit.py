"""The first fit, of the tolerance parameters alone, also where a strong effect takes it to the brink of instability."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model.discrepancy import workflow
from model.discrepancy.output_error.observation import Observation, observed
from model.discrepancy.output_error.search import Point
from tests.model.fitting import imagined

BRINK = "the simulation does not stay finite: the loop is unstable"


def begun() -> tuple[Observation, Point]:
    """A record, and the model as it was given."""
    observation, model, unknowns = observed(imagined.arm(), [imagined.trace(imagined.arm(), seconds=2.0)])
    return observation, workflow._given(observation, model, unknowns)


def unstable(monkeypatch: pytest.MonkeyPatch, where: Any) -> None:
    """No simulation stays finite where `where` of an observation and values says so."""
    real = workflow.point_at

    def point_at(observation: Observation, model: Any, unknowns: Any, values: Any, *more: Any) -> Point:
        if where(observation, values):
            raise SpecError(BRINK)
        return real(observation, model, unknowns, values, *more)

    monkeypatch.setattr(workflow, "point_at", point_at)


def test_it_goes_on_from_the_model_as_it_was_given_where_closed_loops_led_astray(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    observation, given = begun()
    unstable(monkeypatch, lambda here, values: here is observation and not np.array_equal(values, given.values))
    assert workflow._tolerances(observation, given).cost < given.cost


def test_it_begins_where_records_are_followed_if_the_closed_loop_is_unstable(monkeypatch: pytest.MonkeyPatch) -> None:
    observation, given = begun()
    unstable(monkeypatch, lambda here, _: here is not observation)
    assert workflow._tolerances(observation, given).cost < given.cost


def test_a_model_that_is_unstable_everywhere_is_refused_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    observation, given = begun()
    unstable(monkeypatch, lambda *_: True)
    with pytest.raises(SpecError, match=BRINK):
        workflow._tolerances(observation, given)
