"""Common parts of local and remote teaching: its operations, the keys of `daq teach jog`, and the status line."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from daq.contracts.errors import SpecError
from daq.contracts.joint_text import slides, speed_text
from daq.contracts.machine import Machine
from daq.teaching.jog import JOG_SPEED, SLIDE_JOG_SPEED, JogCommand, top_speed
from daq_cli.app.context import console
from daq_cli.app.keyboard import LEFT, RIGHT, Keyboard

if TYPE_CHECKING:
    from daq.teaching.program import Program
    from daq.teaching.recording import RecordedPath

HELP = "1-6 joint   ← → drive while held   + - speed   o c gripper   p keep this posture   q end   Ctrl-C stop"
KEYS_EVERY = 0.05
"""Time (s) between two reads of the keyboard."""
FASTER, SLOWER = 1.25, 0.8


def require_jog_speed(speed: float) -> float:
    """Checks the initial jog speed (rad/s). Raises SpecError, in degrees/s."""
    if not 0 < speed <= JOG_SPEED:
        raise SpecError(
            f"jog speed of {math.degrees(speed):.4g}°/s: allowed are above 0 and up to {math.degrees(JOG_SPEED):.0f}°/s"
        )
    return speed


class Pendant:
    """The joint, direction and speed (rad/s) chosen by keys. No joint exceeds its own limit. A prismatic joint gets the
    same share of its highest jog speed as a revolute one."""

    def __init__(self, machine: Machine, speed: float) -> None:
        self.joint = 1
        self.wish = speed
        self.ended = False
        self.keep = False
        self.gripper: bool | None = None
        self._machine = machine
        self._command: JogCommand | None = None

    @property
    def speed(self) -> float:
        """Speed of the chosen joint in rad/s (m/s if prismatic)."""
        usual = SLIDE_JOG_SPEED / JOG_SPEED if slides(self._machine, self.joint) else 1.0
        return min(self.wish * usual, top_speed(self._machine, self._machine.limits, self.joint))

    @property
    def speed_text(self) -> str:
        """Speed of the chosen joint, for people."""
        return speed_text(self._machine, self.joint, self.speed)

    def command(self, typed: str, now: float) -> JogCommand | None:
        """Returns the newest command after the keys `typed` at `now` (s, the samples' clock); the previous one if these
        keys drive nothing."""
        direction = typed.count(RIGHT) - typed.count(LEFT)
        for key in typed.replace(RIGHT, "").replace(LEFT, ""):
            if key in "123456" and int(key) <= len(self._machine.joints):
                self.joint, self._command = int(key), None
            elif key in "+-":
                self.wish = min(JOG_SPEED, self.wish * (FASTER if key == "+" else SLOWER))
            elif key in "oc":
                self.gripper = key == "c"
            elif key == "p":
                self.keep = True
            elif key == "q":
                self.ended = True
        if direction:
            self._command = JogCommand({self.joint: math.copysign(self.speed, direction)}, now)
        return self._command


class StatusLine:
    """One line at the bottom of the terminal (standard error), rewritten only when it changes."""

    def __init__(self) -> None:
        self._shown = ""

    def show(self, pendant: Pendant) -> None:
        """Shows the joint that the keys drive, and its speed."""
        line = f"joint {pendant.joint}   {pendant.speed_text}"
        if line != self._shown:
            sys.stderr.write(f"\r{line:<{len(self._shown)}}")
            sys.stderr.flush()
            self._shown = line

    def tell(self, line: str) -> None:
        """Prints a separate line; the status follows below it."""
        self.close()
        print(line, file=sys.stderr)

    def close(self) -> None:
        """Ends the line."""
        if self._shown:
            print(file=sys.stderr)
            self._shown = ""


def announce_lead(seconds: float | None) -> None:
    """Prints that the arm may be guided now, and until when."""
    console().print("recording: guide the arm" + ("; Enter ends it" if seconds is None else f" for {seconds:g} s"))


class Driven(Protocol):
    """An arm that keys drive."""

    def jog(self, velocities: Mapping[int, float]) -> None:
        """Drives joints (rad/s, m/s) for at most 0.3 s."""

    def set_gripper(self, *, closed: bool) -> None:
        """Closes or opens the gripper."""

    def set_points(self) -> Mapping[int, float] | None:
        """Set points of the newest sample (rad, m); None if there is none."""

    def wait(self, seconds: float) -> None:
        """Waits. Raises a DaqError if the arm is no longer driven, for example after a stop."""


def drive_with_keys(
    arm: Driven, keyboard: Keyboard, pendant: Pendant, keep: Callable[[Mapping[int, float]], None], line: StatusLine
) -> None:
    """Drives an arm until the pendant ends. Each key press drives for a moment; then the arm holds."""
    line.tell(HELP)
    while not pendant.ended:
        now = time.monotonic()
        command = pendant.command(keyboard.pressed(), now)
        if command is not None and command.time == now:  # only a new command is sent
            arm.jog(command.velocities)
        if pendant.gripper is not None:
            arm.set_gripper(closed=pendant.gripper)
            pendant.gripper = None
        if pendant.keep and (here := arm.set_points()) is not None:
            pendant.keep = False
            keep(here)
        line.show(pendant)
        arm.wait(KEYS_EVERY)


class Teaching(Protocol):
    """An arm that a person teaches. Ctrl-C stops it. Angles are in rad."""

    def jog(self, pendant: Pendant, keep: Callable[[Mapping[int, float]], None], line: StatusLine) -> None:
        """Drives joints by keys; `keep` is called with the set points of each posture that the person saves."""

    def perform(self, program: Program) -> str:
        """Carries out a taught program, and returns a line on how it ended."""

    def lead(self, joints: Sequence[int], seconds: float | None, keep: Callable[[RecordedPath], None]) -> None:
        """Records a path while the arm is guided by hand; `keep` is called with the path, even after a stop."""
