"""The service as a program sees it."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Self

from daq.client import stopping
from daq.client.connection import Connection, Request
from daq.client.experiments import new_key
from daq.client.robot import Robot
from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import Experiment, ExperimentRequest
from daq.contracts.service.fleet import FleetExperimentRequest, FleetExperiments, FleetStatus
from daq.contracts.service.robot import FleetStopResult, RobotSummary, StopResult
from daq.contracts.service.system import Me, SystemStatus


class Client:
    """A client of one service. Methods raise ServiceError for what it refuses, ServiceNotReachedError when it is not
    there. Safe to use from any thread.

    url:      as `daq serve` tells it, such as http://127.0.0.1:8300
    token:    as `daq token add` shows it; None at loopback
    stop_url: address of the stop listener, where it is not at the port after the service's (behind a proxy)
    """

    def __init__(self, url: str, token: str | None = None, *, stop_url: str | None = None) -> None:
        """Connects to nothing yet. Raises SpecError."""
        self._connection = Connection(url, token)
        self._stop_url = stop_url

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends all connections."""
        self._connection.close()

    @property
    def url(self) -> str:
        """Address of the service."""
        return self._connection.url

    def me(self) -> Me:
        """This client as the service identified it."""
        return self._connection.get(Me, "me")

    def system(self) -> SystemStatus:
        """Version, storage, watchers."""
        return self._connection.get(SystemStatus, "system")

    def robots(self, *, within: float | None = None) -> Sequence[RobotSummary]:
        """The robots of the service; with `within` (s for the answer) asked for once."""
        request = Request("GET", "robots", repeatable=within is None, within=within)
        return self._connection.ask(tuple[RobotSummary, ...], request)

    def stop(self) -> StopResult:
        """Freezes every arm of the service, at once. Read `confirmed`: anything else means that an emergency stop is
        needed; a `FleetStopResult` says in `robots` which.

        Asked for at the service and at its stop listener at the same time; never raises.
        """
        addresses = stopping.stop_addresses(self.url, self._stop_url)
        return stopping.stop(addresses, "fleet", self._connection.token, FleetStopResult)

    def fleet(self) -> FleetStatus:
        """The state of every robot at a glance."""
        return self._connection.get(FleetStatus, "fleet")

    def submit_to_all(
        self, spec: ExperimentSpec, robots: Sequence[str] | None = None, *, key: str | None = None
    ) -> Sequence[Experiment]:
        """Puts the same experiment into the queue of each of `robots`; None for all. If one of them cannot run it, none
        gets it."""
        body = FleetExperimentRequest(
            request=ExperimentRequest(spec=spec), robots=None if robots is None else tuple(robots)
        )
        headers = {"Idempotency-Key": key or new_key()}
        request = Request("POST", "fleet/experiments", body, headers=headers, repeatable=True)
        return self._connection.ask(FleetExperiments, request).experiments

    def robot(self, name: str | None = None) -> Robot:
        """One of them, by name; without one, the only one there is. Raises SpecError when there are more."""
        if name is None:
            names = [one.robot for one in self.robots()]
            if len(names) != 1:
                raise SpecError(f"{self.url} has {len(names)} robots: name one of them (--robot): {', '.join(names)}")
            name = names[0]
        return Robot(self._connection, name, self._stop_url)
