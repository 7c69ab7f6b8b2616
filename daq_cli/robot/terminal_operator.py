"""The person at the arm, asked at the terminal, or by lines of a script on standard input."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import typer

from daq.commissioning.memory.procedure import Task
from daq_cli.app.context import console

NO_PAUSE = ("press_emergency_stop", "release_emergency_stop", "switch_off_and_on", "set_inputs", "rest", "command")
"""Tasks that are over when the person says that they are done."""


def words(task: Task) -> str:
    """What a person is asked to do, what to watch, and how to stop."""
    text = {
        "rest": "Leave the arm as it is, switched on and at rest. Nothing is written, nothing moves.",
        "press_emergency_stop": "Hold the arm, for it may sink, and press the emergency stop. The controller itself "
        "must stay switched on. It stays pressed until you are told otherwise.",
        "lead": f"Move joint {task.joint} by hand, and no other: first a few degrees to and fro around where it is, "
        "slowly (some 10 s), then evenly to one end of its range, to the other end, and back to where it was.",
        "push": f"Move joint {task.joint} by hand by about 3 degrees, and leave it there.",
        "place": "Bring the joints to about these postures (0 to 999 over a joint's range), and hold them there: "
        + ", ".join(f"joint {joint}: {posture}" for joint, posture in task.targets.items()),
        "switch_off_and_on": "With the emergency stop still pressed, switch the controller off and on again. The arm "
        "must stay where it is.",
        "release_emergency_stop": "Hold the arm lightly, keep a hand at the emergency stop, and release it. The errors "
        "have been read: the arm should stay where it is. If it moves, press at once.",
        "set_inputs": f"Switch the process inputs so that their number is {task.inputs} (input 1 counts 1, input 2 "
        "counts 2). Without switches at the inputs, skip this.",
        "command": f"Joint {task.joint} will move by at most 4 posture units (a degree of a major axis) and back. "
        "Watch it; the emergency stop ends it.",
    }[task.kind]
    return f"{text} (once more: {task.again})" if task.again else text


@dataclass
class TerminalOperator:
    """Asks for each task: Enter to begin, `s` to skip it, `q` to end the search."""

    read_line: Callable[[], str] = sys.stdin.readline
    step: int = 0
    _waits: bool = field(default=False, repr=False)
    _shown: str = field(default="", repr=False)

    def begin(self, task: Task) -> bool:
        """Asks. Raises Abort for `q` and where the input has ended."""
        self.step += 1
        console().print(f"\n[{self.step}] {words(task)}")
        self._waits = task.kind not in NO_PAUSE
        done = "Enter when you begin" if self._waits else "Enter when it is so"
        console().print(f"    {done}, s to skip, q to end: ", end="")
        answer = self._answer()
        if answer == "s":
            self._waits = False
            return False
        if self._waits:
            console().print("    Reading. Enter when you have finished.")
        return True

    def finished(self) -> bool:
        """Whether Enter was pressed since."""
        if not self._waits:
            return True
        if not select.select([sys.stdin], [], [], 0)[0]:
            return False
        self._waits = False
        self._answer()
        return True

    def read_angle(self, joint: int, number: int) -> float | None:
        """Asks for the angle of a joint that was moved by hand."""
        while True:
            console().print(
                f"    joint {joint}, posture {number}: move and hold it, type its angle in degrees (Enter: no more): ",
                end="",
            )
            answer = self._answer()
            if not answer:
                return None
            try:
                return float(answer)
            except ValueError:
                console().print(f"    {answer!r} is no number")

    def show(self, text: str) -> None:
        """Prints a line."""
        console().print(text)

    def watch(self, postures: Mapping[int, int]) -> None:
        """Shows the postures in one line that is written over."""
        shown = "  ".join(f"{joint}: {posture:3d}" for joint, posture in postures.items())
        if console().is_terminal and shown != self._shown:
            console().print(f"\r    {shown}", end="")
        self._shown = shown

    def _answer(self) -> str:
        line = self.read_line()
        if not line or line.strip().lower() == "q":
            raise typer.Abort
        return line.strip().lower()
