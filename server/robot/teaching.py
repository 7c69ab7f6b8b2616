"""Teaching of one robot: jogging, which begins with its first command, steps, programs, hand guiding."""

from __future__ import annotations

import itertools
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Literal

from daq.contracts.errors import SpecError
from daq.contracts.joint_text import speed_unit
from daq.contracts.service.robot import Activity
from daq.contracts.service.teaching import TaughtPath, TeachingLine, TeachingStatus
from daq.owner.messages import Answer, Finish, HaltRun, JogBegin, JogDrive, LeadBegin, Report, RunProgram, TeachingText
from daq.teaching.jog import DEAD_MAN, top_speed
from daq.teaching.lead import PATIENCE
from daq.teaching.program import Program
from server.problems import ProblemError, conflict
from server.robot.robot import ANSWER_WITHIN, Robot

LINES = 50
"""Number of stored lines for the operator."""
LEAD_ENDS_WITHIN = PATIENCE + ANSWER_WITHIN
"""Time (s) for hand guiding to end: the arm may take PATIENCE to come to rest before its gains are restored."""
IF_A_LEAD_GOES_ON = (
    "HOLD THE ARM: led joints have no drive, and a stop does not hold them; reset it here, then set gains"
)

_HELD = {"stopped": "stopped", "fault": "at fault"}
"""States in which the arm moves only after a reset, in words."""


@dataclass(frozen=True)
class Word:
    """A client's request to move the arm. `said`: its arrival time (s, monotonic). `require_control` is called just
    before the order is sent, and raises if the client may no longer move the arm."""

    said: float
    require_control: Callable[[], object] = lambda: None


class TeachingService:
    """Teaching by a client with control. Safe to use from any thread.

    notify:          called with one line when a teaching activity has ended
    ends_within:     time (s) for an activity to finish on request
    lead_ends_within: the same for hand guiding
    """

    def __init__(
        self,
        robot: Robot,
        notify: Callable[[str], None],
        ends_within: float = ANSWER_WITHIN,
        lead_ends_within: float = LEAD_ENDS_WITHIN,
    ) -> None:
        self._robot = robot
        self._notify = notify
        self._ends_within = ends_within
        self._lead_ends_within = lead_ends_within
        self._changed = threading.Condition(threading.RLock())
        self._numbers = itertools.count(1)
        self._lines: deque[TeachingLine] = deque(maxlen=LINES)
        self._under_way: tuple[Activity, Future[Answer]] | None = None
        self._result = ""
        self._problem = ""
        self._path: TaughtPath | None = None
        robot.listeners.append(self._on_report)

    def jog(self, velocities: dict[int, float], said: float) -> None:
        """Drives joints for at most 0.3 s, by a command that arrived at the time `said` (s, monotonic). A command
        delayed by longer than that is ignored. Raises a 409 if the arm cannot move now, SpecError for a joint that does
        not exist or is too fast."""
        self._require_possible(velocities)
        self._require_not_stopped()
        with self._changed:
            if self._robot.clock.monotonic() - said > DEAD_MAN:
                return
            if self._under_way is None or self._under_way[0] != "jog":
                self._begin(Word(said), "jog", JogBegin)
            self._robot.send(JogDrive(velocities=velocities, said=said))

    def perform(self, word: Word, program: Program, activity: Literal["program", "step"] = "program") -> None:
        """Begins a taught program. Raises a 409 during another teaching activity, or without control."""
        with self._changed:
            self._begin(word, activity, RunProgram, program=program.model_dump(mode="json"), activity=activity)

    def lead(self, word: Word, joints: tuple[int, ...]) -> None:
        """Begins hand guiding. Raises a 409 during another teaching activity, or without control."""
        with self._changed:
            self._begin(word, "lead", LeadBegin, joints=joints)

    def finish(self) -> None:
        """Ends jogging or hand guiding in good order, and waits for the end. A program continues to its own end. Raises
        a 503 if the end does not come."""
        with self._changed:
            under_way = self._under_way
            if under_way is None or under_way[0] not in ("jog", "lead"):
                return
            self._robot.send(Finish())
            leading = under_way[0] == "lead"
            within = self._lead_ends_within if leading else self._ends_within
            if not self._changed.wait_for(lambda: self._under_way is not under_way, within):
                line = f"{under_way[0]} did not end within {within:g} s"
                raise ProblemError(503, "not-reached", line, IF_A_LEAD_GOES_ON if leading else "stop the robot")

    def hold(self) -> None:
        """Ends teaching after control has ended: jogging and hand guiding in good order, a program by a stop. Never
        blocks."""
        with self._changed:
            under_way = self._under_way
        if under_way is not None:
            self._robot.send(Finish() if under_way[0] in ("jog", "lead") else HaltRun())

    def status(self) -> TeachingStatus:
        """Returns the status of teaching now."""
        with self._changed:
            return TeachingStatus(
                activity="none" if self._under_way is None else self._under_way[0],
                lines=tuple(self._lines),
                result=self._result,
                problem=self._problem,
                path=self._path,
            )

    def _begin(self, word: Word, activity: Activity, order: Callable[..., Any], /, **fields: object) -> None:
        if self._under_way is not None and self._under_way[0] == "jog":
            self.finish()
        if self._under_way is not None:
            line = f"the arm is busy: {self._under_way[0]}"
            raise conflict("arm-busy", line, "wait for its end, or stop it")
        self._require_not_stopped()
        word.require_control()  # control may have ended while jogging was being finished
        asked = self._robot.ask(order, asked=word.said, **fields)
        self._result = self._problem = ""
        self._path = None
        self._under_way = (activity, asked)
        asked.add_done_callback(lambda future: self._ended(activity, future))

    def _ended(self, activity: Activity, future: Future[Answer]) -> None:
        error = future.exception()
        answer = None if error is not None else future.result()
        with self._changed:
            self._under_way = None
            self._changed.notify_all()
            self._problem = str(error) if answer is None else answer.problem
            self._result = "" if self._problem or answer is None else str(answer.data.get("text", f"{activity}: done"))
            if answer is not None and "path" in answer.data:
                self._path = TaughtPath.model_validate(answer.data["path"])
            line = self._problem or self._result
        self._notify(f"{activity}: {line}")

    def _on_report(self, report: Report) -> None:
        if isinstance(report, TeachingText):
            with self._changed:
                self._lines.append(
                    TeachingLine(number=next(self._numbers), at=self._robot.clock.utc(), text=report.text)
                )

    def _require_not_stopped(self) -> None:
        arm = self._robot.arm
        if arm is not None and arm.arm in _HELD:
            raise conflict(
                "arm-stopped", f"the arm is {_HELD[arm.arm]}: {arm.cause}", "reset the robot when it is safe"
            )

    def _require_possible(self, velocities: dict[int, float]) -> None:
        machine = self._robot.machine
        for joint, velocity in velocities.items():
            if joint > len(machine.joints):
                raise SpecError(f"velocities.{joint}: {machine.name} has joints 1 to {len(machine.joints)}")
            top, unit = top_speed(machine, machine.limits, joint), speed_unit(machine, joint)
            if not abs(velocity) <= top:
                raise SpecError(f"velocities.{joint} = {velocity} {unit}: allowed are up to ±{top:g} {unit}")
