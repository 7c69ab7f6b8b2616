"""Several robots: the same experiment for all of them or for none, and which of their numbers count as changed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy.exc import OperationalError

from daq.contracts.service.experiments import ExperimentRequest
from daq.contracts.service.fleet import FittedNumber, FleetExperimentRequest, FleetExperiments
from extras.lab.fleet.comparison import CHANCE, Pair, changes_of
from extras.lab.fleet.routes import submit_fleet_experiment
from server.access.caller import LOCAL
from server.problems import ProblemError
from server.services import Services
from server.store.submitted import new_columns
from tests.server.fleet.test_fleet_inside import two_robots

RAMP, OTHER = (
    ExperimentRequest.model_validate(
        {"spec": {"trajectory": {"kind": "ramp", "amplitude": amplitude}, "joints": [1]}, "at": "2100-01-01T00:00:00Z"}
    )
    for amplitude in (0.1, 0.2)
)


def _queued(services: Services) -> dict[str, int]:
    return {rig.robot.name: rig.queue.status().queued for rig in services.robots()}


@pytest.fixture
def services(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Services]:
    """Two robots, not connected."""
    with two_robots(tmp_path, monkeypatch) as made:
        yield made


def _submit(services: Services, body: FleetExperimentRequest) -> FleetExperiments:
    given = services.robots(), services.experiments, services.motions, services.clock
    return submit_fleet_experiment(body, *given, LOCAL, None, "k1")


def test_an_experiment_that_cannot_be_written_for_one_robot_is_queued_on_none(
    services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(robot: str, *others: Any) -> dict[str, Any]:
        if robot == "right":
            raise OperationalError("INSERT", {}, Exception("database or disk is full"))
        return new_columns(robot, *others)

    monkeypatch.setattr("server.store.experiments.new_columns", full)
    with pytest.raises(OperationalError):
        _submit(services, FleetExperimentRequest(request=RAMP))
    assert _queued(services) == {"left": 0, "right": 0}
    assert services.experiments.in_order("left") == []


def test_with_one_key_each_robot_gets_an_experiment_once(services: Services) -> None:
    body = FleetExperimentRequest(request=RAMP)
    services.robot("right").queue.submit(RAMP, "anna", "k1")
    first = _submit(services, body)
    assert _submit(services, body) == first
    assert [one.robot for one in first.experiments] == ["left", "right"]
    assert _queued(services) == {"left": 1, "right": 1}
    services.robot("right").queue.submit(OTHER, "anna", "k2")
    with pytest.raises(ProblemError, match="used for another request"):
        services.experiments.submit_to_each(["left", "right"], RAMP, services.clock.utc(), "anna", "k2")
    assert _queued(services) == {"left": 1, "right": 2}


# ---- which numbers count as changed: held against a published table of the normal distribution, and against chance


def number(value: float, deviation: float = 0.01, unit: str = "N·m", name: str = "a") -> FittedNumber:
    half = 1.96 * deviation
    return FittedNumber(name=name, unit=unit, value=value, deviation=deviation, low=value - half, high=value + half)


def pair(before: float, after: float, robot: str = "left") -> Pair:
    return Pair(robot, {"a": number(before)}, {"a": number(after)})


def test_the_interval_of_a_difference_is_that_of_both_numbers() -> None:
    (found,) = changes_of((Pair("left", {"a": number(0.2, 0.03)}, {"a": number(0.3, 0.04)}),))["left"]
    assert found.difference == pytest.approx(0.1)
    assert (found.low, found.high) == pytest.approx((0.1 - 1.959964 * 0.05, 0.1 + 1.959964 * 0.05), abs=1e-6)
    assert found.changed  # 2.0 deviations, beyond the 1.960 of the table


def test_many_numbers_are_judged_together() -> None:
    """Ten numbers share the chance: 2.807 deviations, the two-sided 0.5 % point of the table."""
    quiet = tuple(pair(0.2, 0.2, f"arm{n}") for n in range(9))
    for deviations, changed in ((2.79, False), (2.82, True)):
        loud = pair(0.2, 0.2 + deviations * 0.01 * 2**0.5)
        assert changes_of((*quiet, loud))["left"][0].changed is changed


def test_noise_alone_seldom_makes_any_arm_count_as_changed() -> None:
    random = np.random.default_rng(1)
    comparisons, arms = 2000, 16
    values = random.normal(0.2, 0.01, (comparisons, arms, 2))
    alarms = sum(
        any(
            one.changed
            for every in changes_of(tuple(pair(*both, f"arm{n}") for n, both in enumerate(row))).values()
            for one in every
        )
        for row in values.tolist()
    )
    assert alarms / comparisons == pytest.approx(CHANCE, abs=0.015)


def test_numbers_that_only_one_fit_determines_or_in_another_unit_are_not_compared() -> None:
    before = {"a": number(0.2), "b": number(1.0, name="b")}
    after = {"a": number(0.2, unit="mN·m"), "c": number(1.0, name="c")}
    assert changes_of((Pair("left", before, after),)) == {"left": ()}
    assert changes_of(()) == {}
