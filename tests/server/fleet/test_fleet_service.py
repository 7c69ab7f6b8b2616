"""Several robots in one service: each has its own queue, stop, lease, traces and stream."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from daq.client import Client
from daq.contracts.errors import SpecError
from daq.traces.reader import read_trace
from tests.server.fleet_service import FleetService, two_arms
from tests.server.other_user import other_users_command_line
from tests.server.polling import reset, until

pytestmark = pytest.mark.slow

RAMP = {"spec": {"trajectory": {"kind": "ramp", "amplitude": 0.1}, "joints": [1, 2]}}
LONG = {"spec": {"trajectory": {"kind": "sine", "duration": 60.0}, "joints": [1]}}


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetService]:
    with two_arms(tmp_path_factory.mktemp("fleet"), seed=3) as service:
        yield service


@pytest.fixture
def fleet(running: FleetService) -> FleetService:
    """The same, with both arms connected, not stopped, and open queues."""
    for name in ("left", "right"):
        for one in running.get(f"robots/{name}/queue/experiments"):
            running.post(f"robots/{name}/experiments/{one['id']}/cancel")
        reset(running.client, name=f"robots/{name}")
        running.post(f"robots/{name}/queue/resume", {})
    return running


def by_name(fleet: FleetService) -> dict[str, Any]:
    return {one["robot"]: one for one in fleet.get("fleet")["robots"]}


def test_the_same_experiment_runs_on_both_and_each_trace_names_its_robot(fleet: FleetService) -> None:
    for one in [fleet.post(f"robots/{name}/experiments", RAMP) for name in ("left", "right")]:
        ended = fleet.end_of(one["robot"], one["id"])
        assert ended["state"] == "done", ended
        files = list((fleet.folder / "traces" / one["robot"]).glob("*.mcap"))
        names = {trace.record.trace_id: trace.record.robot for trace in map(read_trace, files)}
        assert names[ended["trace"]] == one["robot"]
        listed = fleet.get(f"robots/{one['robot']}/traces")["items"]
        assert ended["trace"] in {entry["id"] for entry in listed}
        other = "right" if one["robot"] == "left" else "left"
        assert fleet.client.get(f"robots/{other}/traces/{ended['trace']}").status_code == 404


def test_a_stop_of_one_leaves_the_other_alone(fleet: FleetService) -> None:
    waiting = fleet.post("robots/right/experiments", {**RAMP, "at": "2100-01-01T00:00:00Z"})
    stopped = fleet.post("robots/left/stop")
    assert stopped["confirmed"], stopped
    found = by_name(fleet)
    assert found["left"]["arm"] == "stopped"
    assert found["left"]["queue"]["paused"]
    assert (found["right"]["arm"], found["right"]["queue"]["paused"]) == ("idle", False)
    assert found["right"]["queue"]["queued"] == 1
    fleet.post(f"robots/right/experiments/{waiting['id']}/cancel")


def test_a_stop_of_all_stops_every_arm_at_both_doors(fleet: FleetService) -> None:
    with Client(fleet.url) as client:
        found = client.stop()
        assert found.confirmed, found
        # The listener may have been quicker than the service, which hears of the stops then.
        while any(one.arm != "stopped" or not one.queue.paused for one in client.fleet().robots):
            assert fleet.process.poll() is None
    port = fleet.get("system")["stop_port"]
    answer = fleet.client.post(f"http://127.0.0.1:{port}/api/v1/fleet/stop")
    assert answer.json()["confirmed"], answer.text
    assert set(answer.json()["robots"]) == {"left", "right"}


def test_a_lease_of_one_arm_that_lapses_pauses_only_its_queue(fleet: FleetService) -> None:
    fleet.post("robots/left/experiments", {**RAMP, "at": "2100-01-01T00:00:00Z"})
    lease = fleet.post("robots/left/control", {})["lease"]
    refused = fleet.client.post("robots/right/jog", json={"velocities": {"1": 0.1}}, headers={"Control-Lease": lease})
    assert refused.status_code >= 400

    def is_paused(found: Any) -> bool:
        return any(one["robot"] == "left" and one["queue"]["paused"] for one in found["robots"])

    until(fleet.client, "fleet", is_paused, process=fleet.process)  # no heartbeat is sent
    found = by_name(fleet)
    assert "lapsed" in found["left"]["queue"]["reason"]
    assert not found["right"]["queue"]["paused"]


def test_a_client_that_names_no_robot_is_told_the_names(fleet: FleetService) -> None:
    with Client(fleet.url) as client:
        with pytest.raises(SpecError, match="left, right"):
            client.robot()
        assert client.robot("right").status().robot == "right"


# ---- docs/fleet.md


PAGE = Path(__file__).parents[3].joinpath("docs", "fleet.md").read_text("utf-8")
URL = "http://127.0.0.1:8300"
LINES = [
    line
    for block in re.findall(r"^```console\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    for line in block.splitlines()
]


@pytest.mark.parametrize("line", LINES)
def test_a_command_of_the_page_works(
    line: str, fleet: FleetService, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = shlex.split(line.removeprefix("$ ").replace(URL, fleet.url))
    assert words[0] == "daq"
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        Path("daq.toml").write_text(
            '[robots.left]\nport = "mock://?lock_step=1"\n[robots.right]\nport = "mock://?lock_step=1&seed=2"\n'
        )
        said = daq(*words[1:])
    assert said.code == 0, said


def test_the_program_of_the_page_runs_the_same_experiment_on_both(fleet: FleetService, tmp_path: Path) -> None:
    (program,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    words = [sys.executable, "-c", program.replace(URL, fleet.url)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-2:] == ["done", "done"]
