"""Teaching at this computer's port, with an owner of its own: jogging, programs, hand guiding."""

from __future__ import annotations

import select
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field

from daq.config.robot_files import load_memory_map
from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import Machine
from daq.owner.client import OwnerOnDemand, done
from daq.owner.messages import (
    Answer,
    Finish,
    JogBegin,
    JogDrive,
    LeadBegin,
    LiveSample,
    MoveGripper,
    Report,
    RunProgram,
    TeachingText,
)
from daq.teaching.program import Program
from daq.teaching.recording import RecordedPath
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console
from daq_cli.app.keyboard import open_keyboard
from daq_cli.robot.own_owner import owned
from daq_cli.robot.pendant import Pendant, StatusLine, announce_lead, drive_with_keys

LOOK_EVERY = 0.1
"""Time (s) between two checks whether hand guiding must end."""


@dataclass
class _Seen:
    """Lines and samples reported by an owner. tell: prints a line."""

    tell: Callable[[str], object]
    first: LiveSample | None = None
    newest: LiveSample | None = None

    def on_report(self, report: Report) -> None:
        """Handles a report."""
        if isinstance(report, TeachingText):
            self.tell(report.text)
        elif isinstance(report, LiveSample):
            self.first, self.newest = self.first or report, report

    @property
    def periods(self) -> int:
        """Control periods from the first sample to the newest."""
        return 0 if self.first is None or self.newest is None else self.newest.tick - self.first.tick


@dataclass
class _Driven:
    """`Driven` by an owner in jog mode."""

    owner: OwnerOnDemand
    jogging: Future[Answer]
    line: StatusLine
    seen: _Seen = field(init=False)

    def __post_init__(self) -> None:
        self.seen = _Seen(self.line.tell)

    def jog(self, velocities: Mapping[int, float]) -> None:
        self.owner.send(JogDrive(velocities=dict(velocities), said=time.monotonic()))

    def set_gripper(self, *, closed: bool) -> None:
        answer = self.owner.answer_to(self.owner.begin(MoveGripper, closed=closed), self.seen.on_report)
        if answer.problem:
            self.line.tell(answer.problem)

    def set_points(self) -> Mapping[int, float] | None:
        newest = self.seen.newest
        return None if newest is None else dict(zip(newest.joints, newest.set_point, strict=True))

    def wait(self, seconds: float) -> None:
        self.owner.listen(self.seen.on_report, seconds)
        if self.jogging.done():
            done(self.owner.answer_to(self.jogging, self.seen.on_report))


@dataclass(frozen=True)
class LocalTeaching:
    """`Teaching` at the configured port."""

    call: Invocation
    machine: Machine
    consent: ConsentPrompt

    def jog(self, pendant: Pendant, keep: Callable[[Mapping[int, float]], None], line: StatusLine) -> None:
        """Drives until the pendant ends."""
        with open_keyboard() as keyboard, self._owned() as owner:
            jogging = owner.begin(JogBegin)
            drive_with_keys(_Driven(owner, jogging, line), keyboard, pendant, keep, line)
            owner.send(Finish())
            done(owner.answer_to(jogging))

    def perform(self, program: Program) -> str:
        """Plans and checks the program from the arm's present posture, and carries it out."""
        with self._owned() as owner:
            performing = owner.begin(RunProgram, program=program.model_dump(mode="json"))
            return str(done(owner.answer_to(performing, _Seen(console().print).on_report)).data["text"])

    def lead(self, joints: Sequence[int], seconds: float | None, keep: Callable[[RecordedPath], None]) -> None:
        """Records for `seconds` of the arm's time, or until Enter is pressed."""
        with self._owned() as owner:
            seen, leading = _Seen(console().print), owner.begin(LeadBegin, joints=tuple(joints))
            while seen.first is None and not leading.done():
                owner.listen(seen.on_report, LOOK_EVERY)
            if not leading.done():
                announce_lead(seconds)
            while not leading.done():
                if (
                    bool(select.select([sys.stdin], [], [], 0)[0])
                    if seconds is None
                    else seen.periods * owner.identity.period >= seconds
                ):
                    owner.send(Finish())
                    break
                owner.listen(seen.on_report, LOOK_EVERY)
            answer = owner.answer_to(leading, seen.on_report)
            if "path" in answer.data:
                keep(RecordedPath.model_validate(answer.data["path"]))
            done(answer)

    @contextmanager
    def _owned(self) -> Iterator[OwnerOnDemand]:
        with owned(self.call, self.machine, self.consent, moves=True, live=True) as owner:
            if not load_memory_map(self.call.settings.robot.memory_map).has_gains:
                console().print(GAINS_UNKNOWN)
            yield owner
