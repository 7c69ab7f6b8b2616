"""The client of a whole service."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Self

from daq.client import stopping
from daq.client.connection import Connection, Request
from daq.client.robot import Robot
from daq.contracts.errors import SpecError
from daq.contracts.service.fleet import FleetStatus
from daq.contracts.service.robot import FleetStopResult, RobotSummary, StopResult
from daq.contracts.service.system import Me, SystemStatus


class Client:
    """A client of one service. Methods raise ServiceError if it refuses, ServiceNotReachedError if it cannot be
    reached. Safe to use from any thread.

    url:      as printed by `daq serve`, such as http://127.0.0.1:8300
    token:    as printed by `daq token add`; None at loopback
    stop_url: address of the stop listener, if it is not on the port after the service's (behind a proxy)
    """

    def __init__(self, url: str, token: str | None = None, *, stop_url: str | None = None) -> None:
        """Opens no connection yet. Raises SpecError."""
        self._connection = Connection(url, token)
        self._stop_url = stop_url

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes all connections."""
        self._connection.close()

    @property
    def url(self) -> str:
        """Address of the service."""
        return self._connection.url

    def me(self) -> Me:
        """This client, as identified by the service."""
        return self._connection.get(Me, "me")

    def system(self) -> SystemStatus:
        """Version, storage and clients of the service."""
        return self._connection.get(SystemStatus, "system")

    def robots(self, *, within: float | None = None) -> Sequence[RobotSummary]:
        """Returns the robots of the service. With `within` (s for the answer), the request is sent only once."""
        request = Request("GET", "robots", repeatable=within is None, within=within)
        return self._connection.ask(tuple[RobotSummary, ...], request)

    def stop(self) -> StopResult:
        """Freezes every arm of the service at once. If `confirmed` is false, an emergency stop is needed: `robots` of a
        `FleetStopResult` states which.

        The request goes to the service and to its stop listener at the same time. Never raises.
        """
        addresses = stopping.stop_addresses(self.url, self._stop_url)
        return stopping.stop(addresses, "fleet", self._connection.token, FleetStopResult)

    def fleet(self) -> FleetStatus:
        """Returns an overview of every robot."""
        return self._connection.get(FleetStatus, "fleet")

    def robot(self, name: str | None = None) -> Robot:
        """Returns a robot by name; without a name, the only robot. Raises SpecError if there are several."""
        if name is None:
            names = [one.robot for one in self.robots()]
            if len(names) != 1:
                raise SpecError(f"{self.url} has {len(names)} robots: name one of them (--robot): {', '.join(names)}")
            name = names[0]
        return Robot(self._connection, name, self._stop_url)
