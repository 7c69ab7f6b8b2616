"""Several robots in a service inside this process: what goes wrong with one, and what becomes of the others."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

from daq.acquisition.stop_socket import FOLDER_VARIABLE
from daq.config.service import ServiceSettings
from daq.config.settings import FleetRobotSettings, Settings, TraceSettings
from daq.contracts.service.experiments import ExperimentRequest
from daq.contracts.service.fleet import FleetExperimentRequest
from server.access.caller import LOCAL
from server.api.fleet import submit_fleet_experiment
from server.api.system import get_system
from server.clock import SystemClock
from server.problems import ProblemError
from server.services import Services
from server.store.submitted import new_columns

RAMP, OTHER = (
    ExperimentRequest.model_validate(
        {"spec": {"trajectory": {"kind": "ramp", "amplitude": amplitude}, "joints": [1]}, "at": "2100-01-01T00:00:00Z"}
    )
    for amplitude in (0.1, 0.2)
)


@pytest.fixture
def services(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Services]:
    """Two robots, not connected, whose traces are in folders of their own."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "run"))
    made = Services(
        Settings(
            robots={name: FleetRobotSettings(port="mock://", traces=tmp_path / name) for name in ("left", "right")},
            traces=TraceSettings(folder=tmp_path / "traces", warn_at=1e-9),
            server=ServiceSettings(folder=tmp_path / "service", connect_at_start=False),
        ),
        SystemClock(),
    )
    made.start()
    made.stop_port = 8301
    yield made
    made.close()


def _queued(services: Services) -> dict[str, int]:
    return {rig.robot.name: rig.queue.status().queued for rig in services.robots()}


def test_a_folder_that_is_away_hides_neither_the_port_of_the_stop_nor_the_other_disk(
    services: Services, tmp_path: Path
) -> None:
    both = get_system(services, LOCAL)
    (tmp_path / "right").rmdir()
    found = get_system(services, LOCAL)
    assert found.stop_port == 8301
    assert found.storage.traces_free > 0
    assert found.storage.traces_size == both.storage.traces_size  # one disk, which counts once
    assert any(line.startswith(f"right: the folder of traces, {tmp_path / 'right'}: ") for line in found.warnings)


def test_the_disk_of_a_robots_own_folder_is_told_once_with_the_robots_names(services: Services) -> None:
    (line,) = services.warnings()
    assert line.startswith("left, right: the disk of the traces is ")


def test_an_experiment_that_cannot_be_written_for_one_robot_is_queued_on_none(
    services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(robot: str, *others: Any) -> dict[str, Any]:
        if robot == "right":
            raise OperationalError("INSERT", {}, Exception("database or disk is full"))
        return new_columns(robot, *others)

    monkeypatch.setattr("server.store.experiments.new_columns", full)
    with pytest.raises(OperationalError):
        submit_fleet_experiment(FleetExperimentRequest(request=RAMP), services, LOCAL, None, "k1")
    assert _queued(services) == {"left": 0, "right": 0}
    assert services.experiments.in_order("left") == []


def test_with_one_key_each_robot_gets_an_experiment_once(services: Services) -> None:
    body = FleetExperimentRequest(request=RAMP)
    services.robot("right").queue.submit(RAMP, "anna", "k1")
    first = submit_fleet_experiment(body, services, LOCAL, None, "k1")
    assert submit_fleet_experiment(body, services, LOCAL, None, "k1") == first
    assert [one.robot for one in first.experiments] == ["left", "right"]
    assert _queued(services) == {"left": 1, "right": 1}
    services.robot("right").queue.submit(OTHER, "anna", "k2")
    with pytest.raises(ProblemError, match="used for another request"):
        services.experiments.submit_to_each(["left", "right"], RAMP, services.clock.utc(), "anna", "k2")
    assert _queued(services) == {"left": 1, "right": 2}
