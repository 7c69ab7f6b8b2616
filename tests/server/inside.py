"""A service inside the tests' own process, for what cannot be done to another one: to its clock, to its disk."""

import socket
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import MappingProxyType
from typing import Any

import httpx
import pytest
import uvicorn

from daq.config.section import Section
from daq.config.service import ServiceSettings
from daq.config.settings import RobotSettings, TraceSettings, settings_type
from daq.owner.stop_socket import FOLDER_VARIABLE
from server.access.gate import Gate
from server.access.tokens import KnownTokens
from server.app import make_app
from server.clock import SystemClock
from server.services import Services
from tests.server.migrated import place_database
from tests.server.service import MOCK

ANSWER_WITHIN = 100.0


@dataclass
class WrongClock(SystemClock):
    """The computer's, with a wall clock that is set; the other one goes on."""

    ahead: timedelta = timedelta(0)

    def utc(self) -> datetime:
        return datetime.now(UTC) + self.ahead


class _Server(uvicorn.Server):
    """Says when it answers, or never will."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.begun = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """As uvicorn's."""
        try:
            await super().startup(sockets)
        finally:
            self.begun.set()


@contextmanager
def service_inside(
    folder: Path,
    clock: SystemClock,
    monkeypatch: pytest.MonkeyPatch,
    sections: Mapping[str, Section] = MappingProxyType({}),
    **robot: Any,
) -> Iterator[httpx.Client]:
    """The robot's API of a service that is not connected, on a mock in lock-step. All that it keeps is in `folder`, in
    and in `database`. robot: more of its section of the configuration; sections: those of plug-ins."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder / "run"))
    settings = settings_type()(
        robot=RobotSettings(**{"port": MOCK} | robot),
        traces=TraceSettings(folder=folder / "traces"),
        server=ServiceSettings(folder=folder / "service", connect_at_start=False),
        **sections,
    )
    place_database(folder / "service" / "service.sqlite")
    services = Services(settings, clock)
    gate = Gate(KnownTokens(services.tokens, clock), services.tickets, open_on_loopback=True, parts=services.parts)
    server = _Server(uvicorn.Config(make_app(services, gate), log_config=None, lifespan="on"))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=server.run, args=([listener],), name="service")
        thread.start()
        try:
            server.begun.wait()
            assert server.started
            url = f"http://127.0.0.1:{listener.getsockname()[1]}/api/v1/robots/ma2000"
            with httpx.Client(base_url=url, timeout=ANSWER_WITHIN) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join()
