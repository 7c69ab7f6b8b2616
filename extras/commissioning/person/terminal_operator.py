"""Asks the person at the arm, at the terminal or by lines of a script on standard input."""

from __future__ import annotations

import contextlib
import os
import select
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import typer

from daq_cli.app.consent import can_be_asked
from daq_cli.app.context import console
from extras.commissioning.memory.procedure import Task

NO_PAUSE = (
    "end_freeze",
    "press_emergency_stop",
    "hold_for_release",
    "set_inputs",
    "rest",
    "command",
    "unplug",
    "plug_in",
)
"""Tasks that end when the person says that they are done."""
LARGEST_ANGLE = 360
"""Largest joint angle (degrees), to either side, that can be typed."""
AT_ONCE = ("release_emergency_stop",)
"""Tasks that begin without a question, because one has just been answered."""


def words(task: Task) -> str:
    """Says what a person is asked to do, what to watch, and how to stop."""
    text = {
        "rest": "Leave the arm as it is, switched on and at rest. Nothing is written, and nothing moves.",
        "press_emergency_stop": "Hold the arm, because it may sink, and press the emergency stop. The controller "
        "itself must stay switched on. Keep it pressed until you are told otherwise.",
        "lead": f"Move joint {task.joint} by hand, and no other: first a few degrees to and fro around its posture, "
        "slowly (about 10 s), then evenly to one end of its range, to the other end, and back.",
        "push": f"Move joint {task.joint} by hand by about 3 degrees, leave it there, and let go of it.",
        "end_stop": f"Move joint {task.joint} by hand, gently, until it meets an end stop, and hold it there.",
        "other_end_stop": f"Now move joint {task.joint} the other way until it meets its other end stop, and hold it.",
        "bring_back": f"Move joint {task.joint} back to about its first posture, well clear of its end stops.",
        "unplug": "Unplug the cable between this computer and the bridge.",
        "plug_in": "Plug it in again, and wait a moment.",
        "place": "Move the joints to about these postures (0 to 999 over a joint's range), and hold them there: "
        + ", ".join(f"joint {joint}: {posture}" for joint, posture in task.targets.items()),
        "switch_off_and_on": "With the emergency stop still pressed, switch the controller off and on again. The arm "
        "must stay where it is.",
        "start_as_usual": "Switch the controller off. Only while it is off, release the emergency stop. Then step "
        "back, keep a hand at the emergency stop, and switch the controller on as on any other day.",
        "hold_for_release": "Hold the arm lightly, and keep a hand at the emergency stop. Do not release it yet.",
        "release_emergency_stop": "The errors have been read again: release the emergency stop now, and keep a hand at "
        "the emergency stop. The arm should stay where it is. If it moves, press at once.",
        "set_inputs": f"Switch the process inputs so that their number is {task.inputs} (input 1 counts 1, input 2 "
        "counts 2). Without switches at the inputs, skip this.",
        "end_freeze": "The bridge holds the set points: it does so after its program was loaded, or after somebody has "
        "stopped the arm. Continue to release the stop; this moves nothing.",
        "command": f"Joint {task.joint} will move by at most 4 posture units (a degree of a major axis) and back. "
        "Watch it; the emergency stop ends it.",
    }[task.kind]
    hint = "; is the emergency stop pressed, and does no other joint move?" if task.kind == "lead" else ""
    return f"{text} (once more: {task.again}{hint})" if task.again else text


class Lines:
    """Reads lines of standard input without Python's buffer, so that `select` reports correctly whether one has
    arrived."""

    def __init__(self, descriptor: int | None = None) -> None:
        self._descriptor = descriptor
        self._held = b""
        self._ended = False

    def forget(self) -> None:
        """Discards lines that were typed ahead at a terminal; the lines of a script stay."""
        descriptor = self._open()
        if os.isatty(descriptor):
            with contextlib.suppress(ImportError):  # Windows has none
                import termios

                termios.tcflush(descriptor, termios.TCIFLUSH)
            self._held = b""

    def ready(self) -> bool:
        """Whether a line, or the end, has arrived."""
        while b"\n" not in self._held and not self._ended and select.select([self._open()], [], [], 0)[0]:
            self._read()
        return b"\n" in self._held or self._ended

    def read(self) -> str:
        """Returns the next line; empty at the end."""
        while b"\n" not in self._held and not self._ended:
            self._read()
        line, newline, self._held = self._held.partition(b"\n")
        return (line + newline).decode(errors="replace")

    def _open(self) -> int:
        if self._descriptor is None:
            try:
                self._descriptor = sys.stdin.fileno()
            except (AttributeError, OSError, ValueError):  # without standard input
                self._descriptor = os.open(os.devnull, os.O_RDONLY)
        return self._descriptor

    def _read(self) -> None:
        part = os.read(self._open(), 4096)
        self._ended = not part
        self._held += part


@dataclass
class TerminalOperator:
    """Asks for each task: Enter to begin, `s` to skip it, `q` to end the search."""

    read_line: Callable[[], str] | None = None
    lines: Lines = field(default_factory=Lines, repr=False)
    step: int = 0
    _waits: bool = field(default=False, repr=False)
    _shown: str = field(default="", repr=False)

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        """Asks before a step. Raises Abort for `q` and at the end of the input.

        A step at the arm always needs an answer, even from a script; other steps only from a person.
        """
        if not at_the_arm and (yes or not can_be_asked()):
            return True
        return self._choice("    Enter to begin, s to leave it open, q to end: ") != "s"

    def begin(self, task: Task) -> bool:
        """Asks for a task. Raises Abort for `q` and at the end of the input."""
        self.step += 1
        console().print(f"\n[{self.step}] {words(task)}")
        self._waits = task.kind not in NO_PAUSE
        if task.kind in AT_ONCE:
            self.lines.forget()
            console().print("    Reading. Enter when it is done; q to end.")
            return True
        done = "Enter when you begin" if self._waits else "Enter when it is so"
        if self._choice(f"    {done}, s to skip, q to end: ") == "s":
            self._waits = False
            return False
        if self._waits:
            console().print("    Reading. Enter when you have finished.")
        return True

    def finished(self) -> bool:
        """Whether Enter was pressed since."""
        if not self._waits:
            return True
        if self.read_line is None and not self.lines.ready():
            return False
        if answer := self._answer():
            console().print(f"    {answer!r}: Enter when you have finished, q to end")
            return False
        self._waits = False
        return True

    def read_angle(
        self, joint: int, number: int, wait: Callable[[float], None]
    ) -> float | Literal["taken back"] | None:
        """Asks for the angle of a joint that was moved by hand."""
        del wait  # a person may take any time
        while True:
            self.lines.forget()
            console().print(
                f"    joint {joint}, posture {number}: move and hold it, type its angle in degrees "
                "(Enter: no more, b: remove the last one): ",
                end="",
            )
            answer = self._answer()
            if not answer:
                return None
            if answer == "b":
                return "taken back"
            try:
                angle = float(answer)
            except ValueError:
                console().print(f"    {answer!r} is not a number")
                continue
            if abs(angle) <= LARGEST_ANGLE:
                return angle
            console().print(f"    {answer}°: a joint's angle is between -{LARGEST_ANGLE}° and {LARGEST_ANGLE}°")

    def show(self, text: str) -> None:
        """Prints a line."""
        console().print(text)

    def watch(self, postures: Mapping[int, int]) -> None:
        """Shows the postures in one line that is overwritten."""
        shown = "  ".join(f"{joint}: {posture:3d}" for joint, posture in postures.items())
        if console().is_terminal and shown != self._shown:
            console().print(f"\r    {shown}", end="")
        self._shown = shown

    def _choice(self, question: str) -> str:
        """Asks until the answer is Enter or `s`, and returns it. Raises Abort for `q` and at the end of the input."""
        while True:
            self.lines.forget()
            console().print(question, end="")
            answer = self._answer()
            if answer in ("", "s"):
                return answer
            console().print(f"    {answer!r} is none of Enter, s and q")

    def _answer(self) -> str:
        line = self.read_line() if self.read_line else self.lines.read()
        if not line or line.strip().lower() == "q":
            raise typer.Abort
        return line.strip().lower()
