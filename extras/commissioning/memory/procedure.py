"""Procedure for finding a memory map: actions of a person, readings during them, and what may be written.

Nothing is written before `prove_by_command`, and there only the low byte of a set point that the readings have proved.
The emergency stop is pressed while the arm is moved by hand. It is released only when every error reads as small: a
controller with its set points elsewhere would move the arm there.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from daq.contracts.errors import DaqError
from extras.commissioning.memory.findings import Findings, judge
from extras.commissioning.memory.joint import JointEvidence, joint_evidence, set_point_bytes
from extras.commissioning.memory.recording import PageReading, Recording, Stage, StageKind
from extras.commissioning.memory.relations import position_of, signed_of
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import ADC_COUNTS, POSTURE_UNITS

AT_REST = 150
"""Number of readings of a memory at rest. In that time a counter of every period runs on by more than a joint at rest
may move."""
AFTER_POWER_UP = 30
"""Number of readings after switching on."""
ALIVE_VALUES = 5
"""Least number of different bytes in a live memory: without supply it reads the same everywhere."""
POWER_UP_S = 20.0
"""Time (s) that a controller may need until its memory is live, after the person says that it is switched on."""
ATTEMPTS = 3
"""How often a joint is led by hand before it is given up."""
MOST_POWER_CYCLES = 8
"""How often the controller is power-cycled before set points are given up."""
QUARTERS = (128, 384, 640, 880)
"""Postures (posture units) with different high bytes of the set point."""
_WAYS = ((0, 1, 2, 3, 1, 2), (1, 2, 3, 0, 3, 0), (3, 0, 1, 2, 0, 1))
"""The quarters of joints 1 to 6 at the first three power-ups; later each moves on by one."""
SAFE_ERROR = 12
"""Largest error (ADC counts) with which the drives may get power: the arm will move by that much."""

TaskKind = Literal[
    "rest",
    "press_emergency_stop",
    "lead",
    "push",
    "end_stop",
    "other_end_stop",
    "bring_back",
    "unplug",
    "plug_in",
    "place",
    "switch_off_and_on",
    "start_as_usual",
    "hold_for_release",
    "release_emergency_stop",
    "set_inputs",
    "end_freeze",
    "command",
]


@dataclass(frozen=True)
class Task:
    """An action that a person is asked for.

    joint:   the joint to be led by hand
    targets: approximate postures (posture units) for joints
    inputs:  bits of the process inputs that are to be on
    again:   reason for asking again; empty the first time
    """

    kind: TaskKind
    joint: int | None = None
    targets: Mapping[int, int] = field(default_factory=dict)
    inputs: int = 0
    again: str = ""


class Operator(Protocol):
    """The person at the arm, or a stand-in."""

    def begin(self, task: Task) -> bool:
        """Asks for an action; returns when the person begins, or has done one that takes no time. False: it cannot be
        done."""

    def finished(self) -> bool:
        """Whether the person has finished the action."""

    def show(self, text: str) -> None:
        """Shows a text."""

    def watch(self, postures: Mapping[int, int]) -> None:
        """Shows the present postures of the joints (posture units), whenever they are known."""


class Page(Protocol):
    """The shared memory."""

    base: int
    size: int
    period_s: float

    def read(self) -> PageReading:
        """Returns all bytes. Raises LinkError."""

    def read_byte(self, address: int) -> int:
        """Returns one byte."""

    def write_byte(self, address: int, value: int) -> None:
        """Writes one byte. Only for addresses with a proved meaning."""

    def reconnect(self) -> bool:
        """Reconnects after a power cycle; returns whether the controller reports a restart."""

    def wait(self, seconds: float) -> None:
        """Waits."""


@dataclass
class Finder:
    """One search. `enough` is how many inputs are switched; 0 leaves the inputs out."""

    page: Page
    operator: Operator
    inputs: int = 0
    keep: Callable[[Recording], None] = lambda _recording: None
    """Called after every stage, so that nothing is lost."""
    pressed: Callable[[bool], None] = lambda _pressed: None
    """Called when the emergency stop is about to be pressed (True), or was not (False)."""
    recording: Recording = field(init=False)
    power_cycle: int = 0

    def __post_init__(self) -> None:
        self.recording = Recording(self.page.base, self.page.size, self.page.period_s)

    def find(self) -> Findings:
        """Finds all that can be found without writing."""
        if not self._do(Task("rest")):
            return judge(self.recording)
        self._read("rest", None, AT_REST)
        self.pressed(True)
        if not self._do(Task("press_emergency_stop")):
            self.pressed(False)
        else:
            joints = self._lead_all()
            self._switch_inputs()
            self._switch_on(joints)
        return judge(self.recording)

    # --- stages

    def _lead_all(self) -> list[JointEvidence]:
        """Has every joint led once by hand, to see which bytes follow each; then again those still unclear."""
        wanted = dict.fromkeys(range(1, JOINTS + 1), "")
        for _ in range(ATTEMPTS):
            for joint, lacks in wanted.items():
                if self._do(Task("lead", joint=joint, again=lacks)):
                    self._read("lead", joint)
            found = [joint_evidence(self.recording, joint) for joint in range(1, JOINTS + 1)]
            wanted = {one.joint: one.lacks for one in found if one.pair is None or one.power is None}
            if not wanted:
                break
        return found

    def _switch_inputs(self) -> None:
        for bits in (1, 0, 3, 1, 0)[: self.inputs]:
            if not self._do(Task("set_inputs", inputs=bits)):
                return
            self._read("inputs", bits, 8)

    def _switch_on(self, joints: Sequence[JointEvidence]) -> None:
        """Finds set points by power cycles at other postures, until their bytes are clear."""
        known = {joint.joint: joint for joint in joints if joint.pair is not None}
        again = ""
        while known and self.power_cycle < MOST_POWER_CYCLES:
            targets = {joint: _quarter(joint, self.power_cycle) for joint in known}
            if not self._do(Task("place", targets=targets, again=again)):
                return
            self._watch_until_finished(known)
            if not switched_off_and_on(self.page, self.operator):
                return
            self.power_cycle += 1
            self._read("power_up", None, AFTER_POWER_UP)
            open_joints = [joint for joint, one in known.items() if not self._has_set_point(one)]
            if self.power_cycle >= 3 and not open_joints:
                return
            again = f"set points of joints {', '.join(map(str, open_joints))} are not clear yet" if open_joints else ""

    def _has_set_point(self, one: JointEvidence) -> bool:
        found = None if one.pair is None else set_point_bytes(self.recording, one.joint, one.pair)
        return found is not None and found.place is not None

    def _watch_until_finished(self, known: Mapping[int, JointEvidence]) -> None:
        self.operator.watch(self.postures(known))
        while not self.operator.finished():
            self.operator.watch(self.postures(known))

    def postures(self, known: Mapping[int, JointEvidence]) -> dict[int, int]:
        """Returns the present postures of the joints (posture units)."""
        pages = np.frombuffer(self.page.read().data, np.uint8)[None, :]
        return {
            joint: int(position_of(pages, one.pair.position)[0] * POSTURE_UNITS / ADC_COUNTS)
            for joint, one in known.items()
            if one.pair is not None
        }

    def _do(self, task: Task) -> bool:
        return self.operator.begin(task)

    def _read(self, kind: StageKind, joint: int | None, count: int | None = None) -> None:
        """Reads `count` times, or until the person has finished."""
        readings = [self.page.read()]
        while len(readings) < count if count else not self.operator.finished():
            readings.append(self.page.read())
        self.recording.stages.append(Stage.of(kind, joint, self.power_cycle, readings))
        self.keep(self.recording)


def _quarter(joint: int, power_cycle: int) -> int:
    """Returns an approximate posture (posture units) for a joint at a power-up: no two joints change alike."""
    return QUARTERS[(_WAYS[power_cycle % len(_WAYS)][joint - 1] + power_cycle // len(_WAYS)) % len(QUARTERS)]


def errors_now(page: Page, joints: Sequence[JointEvidence]) -> dict[int, int]:
    """Returns the errors (ADC counts) of the joints whose error is known: the median of a few readings."""
    pages = np.frombuffer(b"".join(page.read().data for _ in range(5)), np.uint8).reshape(5, -1)
    return {one.joint: int(np.median(signed_of(pages, one.pair.error))) for one in joints if one.pair is not None}


def may_have_power(errors: Mapping[int, int]) -> str:
    """Returns why the drives may not get power yet; empty if they may."""
    if len(errors) < JOINTS:
        known = ", ".join(map(str, errors)) or "none"
        return f"the error of every joint must be known before the drives may get power; known: {known}"
    far = [f"joint {joint}: {error}" for joint, error in errors.items() if abs(error) > SAFE_ERROR]
    if far:
        return f"errors above {SAFE_ERROR} ADC counts, the arm would jump: {'; '.join(far)}"
    return ""


def is_alive(data: bytes) -> bool:
    """Whether a memory has supply: without it, it reads 00 or FF everywhere."""
    return len(set(data)) >= ALIVE_VALUES


def switched_off_and_on(page: Page, operator: Operator, kind: TaskKind = "switch_off_and_on") -> bool:
    """Has the controller power-cycled, and reads meanwhile; False if the person cannot do it.

    It asks again until the memory was seen without supply, or the controller reports a restart, and the memory is live.
    """
    again = ""
    while operator.begin(Task(kind, again=again)):
        was_off = not _reads_alive(page)
        while not operator.finished():
            was_off |= not _reads_alive(page)
        page.wait(0.1)
        for _ in range(round(POWER_UP_S / 0.1)):
            if _reads_alive(page):
                break
            was_off = True
            page.wait(0.1)
        page.wait(0.5)
        try:
            restarted = page.reconnect()
            alive = is_alive(page.read().data)
        except DaqError:
            restarted = alive = False
        if alive and (was_off or restarted):
            return True
        again = "the memory is not live" if not alive else "no interruption of the supply was seen"
    return False


def _reads_alive(page: Page) -> bool:
    """Whether the memory can be read, and is live. A bridge with the same supply does not answer."""
    try:
        return is_alive(page.read().data)
    except DaqError:
        page.wait(0.1)
        with contextlib.suppress(DaqError):
            page.reconnect()
        return False


def release(page: Page, operator: Operator, against: Callable[[], str]) -> str:
    """Has the emergency stop released once `against` returns no objection; `against` is called repeatedly.

    Returns why it stays pressed, or must be pressed again; empty after a safe release.
    """
    if why := against():
        return f"the emergency stop stays pressed: {why}"
    if not operator.begin(Task("hold_for_release")):
        return "the emergency stop stays pressed, as you wished"
    if why := against():
        return f"the emergency stop stays pressed: {why}"
    if not operator.begin(Task("release_emergency_stop")):
        return "the emergency stop stays pressed, as you wished"
    while True:
        finished = operator.finished()
        if finished:
            page.wait(0.5)
        if why := against():
            operator.show(f"PRESS THE EMERGENCY STOP: {why}")
            return f"press the emergency stop: {why}"
        if finished:
            return ""
