"""The same experiment for several robots of a running service."""

from __future__ import annotations

import pytest

from tests.server.fleet.test_fleet_service import RAMP
from tests.server.fleet_service import FleetService

pytestmark = pytest.mark.slow


def test_an_experiment_that_one_arm_cannot_run_is_queued_on_none(fleet: FleetService) -> None:
    far = {"spec": {"trajectory": {"kind": "ramp", "amplitude": 3.0}, "joints": [1]}}
    answer = fleet.client.post("fleet/experiments", json={"request": far})
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("robot left: ")
    assert "nothing was queued" in answer.json()["detail"]
    assert all(one["queue"]["queued"] == 0 for one in fleet.get("fleet")["robots"])


@pytest.mark.parametrize(
    ("robots", "status", "said"),
    [(["left", "middle"], 404, "middle"), (["left", "left"], 422, "named twice"), ([], 422, "robots")],
)
def test_a_wrong_choice_of_robots_is_one_clear_line(
    fleet: FleetService, robots: list[str], status: int, said: str
) -> None:
    answer = fleet.client.post("fleet/experiments", json={"request": RAMP, "robots": robots})
    assert answer.status_code == status
    assert said in answer.text
