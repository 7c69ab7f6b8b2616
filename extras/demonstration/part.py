"""Demonstrations in a service: one at a time, each on a thread, with a mock of its own in addition to the robot's."""

from __future__ import annotations

import logging
import secrets
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import DaqError
from daq.contracts.service.hidden import Hidden, HideRequest, HidingPlace
from daq.contracts.service.jobs import MACHINE, CompareRequest, DiagnoseRequest, Job
from daq.contracts.service.traces import TraceChange
from daq.owner.client import OwnerOnDemand
from daq.trajectories.set_points import control_period
from daq.transport import parse_port_url
from daq.transport.url import MockPort
from extras.demonstration.hidden import EXPERIMENTS, HidingError, Sealed, choices, draw, opened, record
from server.catalogue.room import require_room
from server.jobs.mailbox import RESULT
from server.parts import Part
from server.problems import ProblemError, conflict
from server.robot_services import RobotServices
from server.services import Services

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Diagnosis

LOOK_EVERY = 0.2
"""Time (s) between two checks for the end of the diagnosis."""
REAL_ARM = "a demonstration needs the mock: this robot is a real arm, or another machine"
ENDED = ("done", "failed", "cancelled", "interrupted")
TAG = "demonstration"
"""Of its traces, and in the name of its diagnosis and of the model from it: they are of another arm than the page's."""
log = logging.getLogger("server.demonstration")


class Demonstrations(Part):
    """Hides effects and lets the service's own jobs look for them. Safe to use from any thread."""

    def __init__(self, services: Services) -> None:
        self._jobs, self._clock, self._traces = services.jobs, services.clock, services.traces
        self._lock = threading.Lock()
        self._latest: dict[str, Hidden] = {}
        self._counts: dict[str, tuple[int, int]] = {}
        self._owner: OwnerOnDemand | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    def place(self, rig: RobotServices) -> HidingPlace:
        """Returns the effects that a robot's mock can hide, and the latest demonstration."""
        problem = _problem(rig)
        with self._lock:
            number, named = self._counts.get(rig.robot.name, (0, 0))
            latest = self._latest.get(rig.robot.name)
        offered = () if problem else choices()
        return HidingPlace(problem=problem, choices=offered, latest=latest, opened=number, named=named)

    def begin(self, rig: RobotServices, request: HideRequest, by: str) -> Hidden:
        """Hides an effect and begins to look for it.

        Raises a 409 on a real arm and while another demonstration runs, and SpecError for an effect that cannot be
        hidden.
        """
        if problem := _problem(rig):
            raise conflict("not-a-mock", problem, "start a service without a configured port: it has a mock")
        require_room(rig.catalogue.folder)
        began = self._clock.utc()  # drawing takes some seconds on a busy computer
        sealed = draw(request)
        with self._lock:
            if self._thread is not None and self._thread.is_alive():
                raise conflict(
                    "demonstration-runs", "another demonstration is running", "wait until its secret is opened"
                )
            hidden = Hidden(
                id=secrets.token_hex(6),
                state="recording",
                began=began,
                seal=sealed.seal,
                picked=request,
            )
            self._latest[rig.robot.name] = hidden
            self._thread = threading.Thread(
                target=self._run, args=(rig, sealed, hidden, by), name="demonstration", daemon=True
            )
            self._thread.start()
        return hidden

    def close(self, seconds: float) -> None:
        """Halts a running recording; its job ends with the others."""
        self._closing.set()
        owner, thread = self._owner, self._thread
        if owner is not None:
            owner.halt()
        if thread is not None:
            thread.join(seconds)

    def _run(self, rig: RobotServices, sealed: Sealed, hidden: Hidden, by: str) -> None:
        try:
            hidden = self._recorded(rig, sealed, hidden, by)
            hidden = self._asked(rig, hidden, by)
            answer = self._answered(rig, hidden)
            secret = opened(sealed, answer, rig.robot.machine)
            with self._lock:
                number, named = self._counts.get(rig.robot.name, (0, 0))
                if answer is not None:
                    self._counts[rig.robot.name] = number + 1, named + (secret.outcome == "named")
            seconds = (self._clock.utc() - hidden.began).total_seconds()
            self._keep(rig, hidden, state="opened", secret=secret, seconds=seconds)
        except (DaqError, ProblemError) as error:
            self._failed(rig, sealed, str(error))
        except Exception as error:
            log.exception("demonstration")
            self._failed(rig, sealed, f"program fault: {error}")

    def _failed(self, rig: RobotServices, sealed: Sealed, problem: str) -> None:
        """Keeps why a demonstration failed, and opens its secret if that is possible: a visitor may have guessed it."""
        try:
            secret = None if self._closing.is_set() else opened(sealed, None, rig.robot.machine)
        except DaqError:
            secret = None
        self._keep(rig, self._latest[rig.robot.name], state="failed", problem=problem, secret=secret)

    def _recorded(self, rig: RobotServices, sealed: Sealed, hidden: Hidden, by: str) -> Hidden:
        """Records both experiments, enters their traces in the catalogue, and compares the first with the machine file
        while the second is recorded."""
        fitted, held_out = EXPERIMENTS
        trace, motion = self._trace(rig, sealed, fitted)
        compare = CompareRequest(traces=(trace,), models=(MACHINE,))
        comparison, _ = rig.jobs.submit(compare, by, None)
        hidden = self._keep(rig, hidden, trace=trace, motion=motion, comparison=comparison.id)
        held, _ = self._trace(rig, sealed, held_out)
        return self._keep(rig, hidden, held_out=held)

    def _trace(self, rig: RobotServices, sealed: Sealed, name: str) -> tuple[str, float]:
        """Returns the ID of a new trace, and the duration of its motion."""
        finished = record(sealed, name, rig.robot.machine, rig.catalogue.folder, self._hold)
        self._owner = None
        number = rig.catalogue.add(Path(finished.trace))
        if number is None:
            raise HidingError("the recorded trace could not be taken in; the service's log says why")
        self._traces.change(rig.robot.name, number, TraceChange(tags=(TAG,)))
        rig.record_event("trace", f"{Path(finished.trace).name} was recorded")
        return number, finished.samples * control_period(rig.robot.machine)

    def _hold(self, owner: OwnerOnDemand) -> None:
        self._owner = owner
        if self._closing.is_set():
            owner.halt()

    def _asked(self, rig: RobotServices, hidden: Hidden, by: str) -> Hidden:
        """Submits the traces to a job of the service."""
        assert hidden.trace is not None
        assert hidden.held_out is not None
        request = DiagnoseRequest(
            traces=(hidden.trace,), held_out=(hidden.held_out,), most_steps=1, name=f"{TAG} {hidden.id}"
        )
        diagnosis, _ = rig.jobs.submit(request, by, None)
        return self._keep(rig, hidden, state="diagnosing", diagnosis=diagnosis.id)

    def _answered(self, rig: RobotServices, hidden: Hidden) -> Diagnosis | None:
        """Waits for the answer; None if the search was cancelled. Raises HidingError if it failed."""
        from server.jobs.results import DiagnosisJobResult  # imported late because it is slow to import

        while (job := self._job(rig, hidden)).state not in ENDED:
            if self._closing.wait(LOOK_EVERY):
                raise HidingError("the service ended")
        if job.state == "cancelled":
            return None
        if job.state != "done":
            raise HidingError(f"the diagnosis has no answer: {job.reason}")
        result = DiagnosisJobResult.model_validate_json(rig.jobs.result_file(job.id, RESULT).read_bytes())
        return result.data

    def _job(self, rig: RobotServices, hidden: Hidden) -> Job:
        assert hidden.diagnosis is not None
        return self._jobs.get(rig.robot.name, hidden.diagnosis)

    def _keep(self, rig: RobotServices, hidden: Hidden, **changes: object) -> Hidden:
        changed = hidden.model_copy(update=changes)
        with self._lock:
            self._latest[rig.robot.name] = changed
        return changed


def _problem(rig: RobotServices) -> str:
    """Returns why a robot can hide nothing; empty if it can."""
    is_mock = isinstance(parse_port_url(rig.robot.place.url), MockPort)
    return "" if is_mock and rig.robot.machine.name == "ma2000" else REAL_ARM
