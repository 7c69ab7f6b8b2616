"""A stop that is asked for while the link to the robot is lost: told as that, and delivered before anything else."""

from __future__ import annotations

from pathlib import Path

import httpx

from tests.mock.process.running import RunningMock
from tests.server.polling import reset
from tests.server.service import running_service


def test_a_stop_while_the_link_is_lost_is_not_said_to_be_confirmed_and_is_there_when_the_link_is(
    tmp_path: Path,
) -> None:
    """At either door: that of the service, and that of its listener."""
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        running_service(tmp_path, f"{mock.url}?lock_step=1") as service,
    ):
        service.until_connected()
        port = service.client.get("/system").json()["stop_port"]
        for door in (service.url, f"http://127.0.0.1:{port}"):
            mock.control("disconnect")
            service.until_link("lost")
            queue = service.robot.get("/queue").json()
            assert queue["paused"]
            assert queue["reason"].startswith("the link to the robot was lost")
            told = httpx.post(f"{door}/api/v1/robots/ma2000/stop", timeout=60).json()
            assert not told["confirmed"]
            assert "emergency stop" in told["text"]
            assert not mock.control("state")["frozen"]
            mock.control("reconnect")
            service.until_arm("stopped")
            assert mock.control("state")["frozen"] is True
            refused = service.robot.post("/queue/resume", json={})
            assert refused.json()["type"] == "/api/v1/problems#arm-stopped"
            assert reset(service.robot).status_code == 200
            assert service.robot.post("/queue/resume", json={}).status_code == 200
            assert mock.control("state")["frozen"] is False
        service.robot.post("/disconnect")
