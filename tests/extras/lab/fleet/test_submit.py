"""The same experiment for several robots: all of them get it once, or none does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

from daq.contracts.service.experiments import ExperimentRequest
from daq.contracts.service.fleet import FleetExperimentRequest, FleetExperiments
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
