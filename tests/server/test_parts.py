"""Parts of the service that plug-ins add."""

from types import SimpleNamespace
from typing import Any

import pytest

from server.parts import Part
from server.services import Services


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
    Services.tell(service, lambda part: part.queue_paused("arm", "stopped"))
    assert listening.heard == ["arm: stopped"]
    assert "Broken" in caplog.text
