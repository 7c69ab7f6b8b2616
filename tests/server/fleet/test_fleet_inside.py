"""Several robots or parts in a service inside this process: what goes wrong with one, and what of the others."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from daq.config.service import ServiceSettings
from daq.config.settings import FleetRobotSettings, Settings, TraceSettings
from daq.owner.stop_socket import FOLDER_VARIABLE
from server.access.caller import LOCAL
from server.api.system import get_system
from server.clock import SystemClock
from server.parts import Part
from server.services import Services


@contextmanager
def two_robots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Services]:
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


def test_a_disk_is_told_once_and_one_that_is_away_hides_neither_the_port_of_the_stop_nor_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with two_robots(tmp_path, monkeypatch) as services:
        (line,) = services.warnings()
        assert line.startswith("left, right: the disk of the traces is ")
        both = get_system(services, LOCAL)
        (tmp_path / "right").rmdir()
        found = get_system(services, LOCAL)
    assert found.stop_port == 8301
    assert found.storage.traces_free > 0
    assert found.storage.traces_size == both.storage.traces_size  # one disk, which counts once
    assert any(line.startswith(f"right: the folder of traces, {tmp_path / 'right'}: ") for line in found.warnings)


class Broken(Part):
    def queue_paused(self, robot: str, reason: str) -> None:
        raise KeyError(robot)


class Listening(Part):
    def __init__(self) -> None:
        self.heard: list[str] = []

    def queue_paused(self, robot: str, reason: str) -> None:
        self.heard.append(f"{robot}: {reason}")


def test_a_part_that_fails_keeps_news_neither_from_the_others_nor_from_the_service(
    caplog: pytest.LogCaptureFixture,
) -> None:
    listening = Listening()
    service: Any = SimpleNamespace(parts=[Broken(), listening])
    Services.notify_parts(service, lambda part: part.queue_paused("arm", "stopped"))
    assert listening.heard == ["arm: stopped"]
    assert "Broken" in caplog.text
