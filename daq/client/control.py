"""Control of the robot: a lease that is renewed while it is held, and the operations that require it."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Self, TypeVar

from pydantic import BaseModel

from daq.client.connection import Connection, Request
from daq.client.errors import ServiceError, ServiceNotReachedError
from daq.contracts import exit_codes
from daq.contracts.consent import require_word
from daq.contracts.errors import DaqError
from daq.contracts.experiment import Gain
from daq.contracts.service.queue import ControlLease, ControlRequest
from daq.contracts.service.robot import GripperRequest, JointGains, OutputRequest, ProcessState
from daq.contracts.service.teaching import JogRequest, LeadRequest, StepRequest, TeachingStatus

HEADER = "Control-Lease"
T = TypeVar("T")
JOIN_WITHIN = 10.0
"""Longest wait (s) for the heartbeat thread to end."""


class ControlLostError(DaqError):
    """The lease has ended, or the service is gone: the arm holds."""

    exit_code = exit_codes.REFUSED


class HeldControl:
    """Holds the control within a `with` block; a separate thread renews the lease. Every motion raises ControlLostError
    once the control is lost."""

    def __init__(self, connection: Connection, robot: str, *, moves_real_arm: bool = False) -> None:
        self._connection = connection
        self._path = robot
        self._moves_real_arm = require_word(moves_real_arm)
        self._lease: ControlLease | None = None
        self._ended = threading.Event()
        self._lost = ""
        self._thread = threading.Thread(target=self._renew, name="control-heartbeat", daemon=True)

    def __enter__(self) -> Self:
        """Takes control. Raises ServiceError if another client has it, or the consent for a real arm is missing."""
        body = ControlRequest(moves_real_arm=self._moves_real_arm)
        self._lease = self._connection.ask(ControlLease, Request("POST", f"{self._path}/control", body))
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Returns control, unless it was lost."""
        self._ended.set()
        self._thread.join(JOIN_WITHIN)
        if self._lost:
            return
        try:
            self._connection.do(Request("DELETE", f"{self._path}/control", headers=self._headers()))
        except (ServiceError, ServiceNotReachedError):
            if kind is None:
                raise

    @property
    def lease(self) -> ControlLease:
        """The newest lease, with its secret. Raises ControlLostError."""
        if self._lost or self._lease is None:
            raise ControlLostError(
                f"the control of the robot is lost: {self._lost or 'it was not taken'}; the arm holds"
            )
        return self._lease

    def jog(self, velocities: Mapping[int, float]) -> TeachingStatus:
        """Drives joints (rad/s; m/s for prismatic ones) for at most 0.3 s; repeat it while the key is held."""
        return self._teaching("jog", JogRequest(velocities=dict(velocities)))

    def step(
        self, *, to: Mapping[int, float] | None = None, by: Mapping[int, float] | None = None, speed: float = 0.25
    ) -> TeachingStatus:
        """Begins one step to absolute angles, or by relative ones (rad, m); the fastest joint moves at `speed` (rad/s;
        m/s if one is prismatic, up to 0.07)."""
        given = {name: dict(angles) for name, angles in (("to", to), ("by", by)) if angles is not None}
        return self._teaching("step", StepRequest(speed=speed, **given))

    def perform(self, program: BaseModel) -> TeachingStatus:
        """Begins a taught program (`daq.teaching.Program`)."""
        return self._teaching("program", program)

    def lead(self, joints: Sequence[int]) -> TeachingStatus:
        """Begins to record a path while the arm is guided by hand. HOLD THE ARM: the guided joints have no drive."""
        return self._teaching("lead", LeadRequest(joints=tuple(joints)))

    def finish(self) -> TeachingStatus:
        """Ends jogging or hand guiding; the answer contains the path."""
        return self._teaching("finish", None)

    def set_gains(self, gains: Mapping[int, Gain]) -> JointGains:
        """Writes gains of some joints, and returns those of all."""
        return self._put(JointGains, "gains", JointGains(gains=dict(gains)))

    def set_output(self, output: int, *, on: bool, while_stopped: bool = False) -> ProcessState:
        """Switches one process output, 0 to 7. Refused while the arm is stopped, unless `while_stopped`."""
        request = OutputRequest(on=on, while_stopped=while_stopped)
        return self._put(ProcessState, f"process/outputs/{output}", request)

    def set_gripper(self, *, closed: bool, while_stopped: bool = False) -> ProcessState:
        """Closes or opens the gripper. Refused while the arm is stopped, unless `while_stopped`."""
        return self._put(ProcessState, "gripper", GripperRequest(closed=closed, while_stopped=while_stopped))

    def _teaching(self, what: str, body: BaseModel | None) -> TeachingStatus:
        request = Request("POST", f"{self._path}/teaching/{what}", body, headers=self._headers())
        return self._connection.ask(TeachingStatus, request)

    def _put(self, answer: type[T], path: str, body: BaseModel) -> T:
        return self._connection.ask(answer, Request("PUT", f"{self._path}/{path}", body, headers=self._headers()))

    def _headers(self) -> dict[str, str]:
        return {HEADER: self.lease.lease}

    def _renew(self) -> None:
        assert self._lease is not None
        while not self._ended.wait(self._lease.heartbeat_every):
            try:
                request = Request("PUT", f"{self._path}/control", headers=self._headers(), repeatable=True)
                self._lease = self._connection.ask(ControlLease, request)
            except (ServiceError, ServiceNotReachedError) as error:
                self._lost = str(error)
                return
