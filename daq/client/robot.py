"""One robot of the service."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

from daq.client import stopping
from daq.client.connection import Connection, Request
from daq.client.control import HeldControl
from daq.client.experiments import Experiments, Queue, Schedules
from daq.client.jobs import Jobs, Models
from daq.client.live import LiveStream, open_stream
from daq.client.traces import Traces
from daq.contracts.machine import Machine
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.live import SampleRate, Topic
from daq.contracts.service.queue import Control
from daq.contracts.service.robot import Done, JointGains, ProcessState, ResetRequest, RobotStatus, StopResult
from daq.contracts.service.teaching import ProgramEntry, TeachingStatus

Content = TypeVar("Content", bound=BaseModel)


class _Kept(BaseModel):
    model_config = ConfigDict(extra="ignore")

    entry: ProgramEntry
    program: dict[str, Any]


class Programs:
    """Lists, reads, stores and deletes programs. Their content is a `daq.teaching.Program`; the caller passes that
    class."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/programs"

    def list(self) -> tuple[ProgramEntry, ...]:
        """Returns the programs, most recently changed first."""
        return self._connection.get(tuple[ProgramEntry, ...], self._path)

    def get(self, kind: type[Content], name: str) -> tuple[Content, ProgramEntry]:
        """Returns a program, parsed as `kind`, with the revision that a change must state. Raises ServiceError."""
        found = self._connection.get(_Kept, f"{self._path}/{name}")
        return kind.model_validate(found.program), found.entry

    def put(self, program: BaseModel, name: str, *, revision: int | None = None) -> ProgramEntry:
        """Stores a new program as `name`, or changes the existing one of that `revision`.

        If the program contains another name, the stored one is renamed. Raises ServiceError if that revision is not the
        newest.
        """
        query = {} if revision is None else {"revision": revision}
        request = Request("PUT", f"{self._path}/{name}", program, query=query, repeatable=True)
        return self._connection.ask(ProgramEntry, request)

    def delete(self, name: str) -> None:
        """Deletes a program permanently."""
        self._connection.do(Request("DELETE", f"{self._path}/{name}"))


CONNECT_PATIENCE = 60.0
"""Time (s) for a mock with its physics engine to start on a busy computer."""
NUMBERED_WITHIN, LOOK_EVERY = 5.0, 0.02
"""Times (s): for the service to read the number of a new stop (a control period or two), and between two checks for
it."""


class Robot:
    """State and operations of one robot."""

    def __init__(self, connection: Connection, name: str, stop_url: str | None = None) -> None:
        self.name = name
        self._connection = connection
        self._path = f"robots/{name}"
        self._stop_addresses = stopping.stop_addresses(connection.url, stop_url)
        self.experiments = Experiments(connection, self._path)
        self.queue = Queue(connection, self._path)
        self.schedules = Schedules(connection, self._path)
        self.traces = Traces(connection, self._path)
        self.jobs = Jobs(connection, self._path)
        self.models = Models(connection, self._path)
        self.programs = Programs(connection, self._path)

    def stop(self) -> StopResult:
        """Freezes the arm at once. If `confirmed` is false, the emergency stop is needed.

        The request goes to the service and to its stop listener at the same time. Never raises.
        """
        return stopping.stop(self._stop_addresses, self._path, self._connection.token)

    def status(self) -> RobotStatus:
        """Returns the present status; every value has its age."""
        return self._connection.get(RobotStatus, self._path)

    def machine(self) -> Machine:
        """Returns its machine file, with the service's limits."""
        return self._connection.get(Machine, f"{self._path}/machine")

    def connect(self) -> RobotStatus:
        """Makes the service connect, and stay connected. Moves nothing."""
        request = Request("POST", f"{self._path}/connect", repeatable=True, patience=CONNECT_PATIENCE)
        return self._connection.ask(RobotStatus, request)

    def disconnect(self) -> Done:
        """Makes the service return the port."""
        return self._connection.ask(Done, Request("POST", f"{self._path}/disconnect"))

    def reset(self, *, here: bool = False, stop: int | None = None) -> Done:
        """Ends a stop or a fault. With `here`, the set points are first set to the measured posture.

        stop: number of the stop (`RobotStatus.stop`); None for the one in force now. A newer stop stays in force and
            raises ServiceError.
        """
        body = ResetRequest(stop=self._newest_stop() if stop is None else stop, here=here)
        return self._connection.ask(Done, Request("POST", f"{self._path}/reset", body))

    def _newest_stop(self) -> int:
        until = time.monotonic() + NUMBERED_WITHIN
        while (found := self.status()).stop is None and found.arm != "disconnected" and time.monotonic() < until:
            time.sleep(LOOK_EVERY)
        return found.stop or 0  # releases no stop: the service returns the error

    def gains(self) -> JointGains:
        """P, I, D of every joint."""
        return self._connection.get(JointGains, f"{self._path}/gains")

    def process(self) -> ProcessState:
        """Process inputs and outputs, and the gripper."""
        return self._connection.get(ProcessState, f"{self._path}/process")

    def teaching(self) -> TeachingStatus:
        """Returns the current teaching activity, and how the last one ended."""
        return self._connection.get(TeachingStatus, f"{self._path}/teaching")

    def events(self, experiment: str | None = None) -> Iterator[ServiceEvent]:
        """Yields events and who caused them, the newest first."""
        return self._connection.every(ServiceEvent, f"{self._path}/events", experiment=experiment)

    def control_status(self) -> Control:
        """Returns who may move the robot now."""
        return self._connection.get(Control, f"{self._path}/control")

    def control(self, *, moves_real_arm: bool = False) -> HeldControl:
        """Returns the control of the robot, for a `with` block; a real arm requires the operator's consent."""
        return HeldControl(self._connection, self._path, moves_real_arm=moves_real_arm)

    def live(self, *topics: Topic, rate: SampleRate | None = None, history: float | None = None) -> LiveStream:
        """Opens a live stream of samples, robot, link, queue, jobs, events and teaching."""
        return open_stream(self._connection, self._path, topics, rate, history)
