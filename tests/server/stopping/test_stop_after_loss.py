"""A stop that is asked for while the way to the robot is lost: the link, or the folder of the stop sockets."""

from __future__ import annotations

import shutil
from pathlib import Path

import httpx
import pytest

from tests.mock.process.running import RunningMock
from tests.server.polling import reset, until
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
            until(service.client, "/robots/ma2000", lambda found: "use the emergency stop" in found["cause"])
            assert not mock.control("state")["frozen"]
            mock.control("reconnect")
            assert "emergency stop" not in service.until_arm("stopped")["cause"]
            assert mock.control("state")["frozen"] is True
            refused = service.robot.post("/queue/resume", json={})
            assert refused.json()["type"] == "/api/v1/problems#arm-stopped"
            assert reset(service.robot).status_code == 200
            assert service.robot.post("/queue/resume", json={}).status_code == 200
            assert mock.control("state")["frozen"] is False
        service.robot.post("/disconnect")


def test_a_stop_needs_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of the stop sockets is removed, as at a logout, and cannot be made again, nor the one in its place."""
    temporary, folder = tmp_path / "temporary", tmp_path / "run"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        running_service(tmp_path, f"{mock.url}?lock_step=1") as service,
    ):
        service.until_connected()
        shutil.rmtree(folder)
        for place in (folder, temporary):
            if place.is_dir():
                shutil.rmtree(place)
            place.write_text("in the way")
        told = service.robot.post("/stop").json()
        assert told["confirmed"], told
        assert mock.control("state")["frozen"] is True
        ready = service.client.base_url.join("/readyz")
        found = until(service.client, str(ready), lambda found: found["checks"]["robot ma2000"])
        assert "stop socket" in found["checks"]["robot ma2000"]
        assert "cannot be made" in found["checks"]["robot ma2000"]
        service.until_arm("stopped")
        assert reset(service.robot).status_code == 200
        folder.unlink()
        until(service.client, str(ready), lambda found: not found["checks"]["robot ma2000"])
        door = service.client.get("/system").json()["stop_port"]
        told = httpx.post(f"http://127.0.0.1:{door}/api/v1/robots/ma2000/stop", timeout=60).json()
        assert told["confirmed"], told
        assert mock.control("state")["frozen"] is True
        service.robot.post("/disconnect")
