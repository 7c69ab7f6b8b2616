"""The stage of line_stage.toml on a pseudo-terminal, in real time: python examples/line_stage_rig.py LINK

--friction 2,1 multiplies the friction of its axes. It shares no code with drivers or models.
"""

from __future__ import annotations

import argparse
import math
import os
import pty
import select
import time
import tty
from pathlib import Path

RESISTANCE, TORQUE_A_AMPERE, SPINDLE = 2.0, 0.05, 2 * math.pi / 0.005
ROTOR, VISCOUS, COULOMB, SUPPLY = 1e-5, 8.0, 12.0, 24.0
COUNT, STEP, GAIN, FULL = 50e-6, 1e-4, 2, 255


class Axis:
    """A motor with a spindle, and a proportional controller."""

    def __init__(self, mass: float, friction: float) -> None:
        self.place, self.speed = 0.1, 0.0
        self.mass, self.coulomb = mass + ROTOR * SPINDLE**2, COULOMB * friction
        self.counts = self.encoder()
        """Measurement of the controller in its latest period."""
        self.goal, self.pwm = self.counts, 0

    def encoder(self) -> int:
        """Returns counts at present."""
        return math.floor(self.place / COUNT + 0.5)

    def period(self, driven: bool) -> None:
        """Simulates a millisecond: the controller measures and acts, then the axis moves."""
        self.counts = self.encoder()
        self.pwm = max(-FULL, min(FULL, GAIN * (self.goal - self.counts))) if driven else 0
        for _ in range(round(1e-3 / STEP)):
            volts = SUPPLY * self.pwm / FULL - TORQUE_A_AMPERE * SPINDLE * self.speed
            force = TORQUE_A_AMPERE * SPINDLE * volts / RESISTANCE - VISCOUS * self.speed
            free, most = self.speed + force / self.mass * STEP, self.coulomb / self.mass * STEP
            self.speed = math.copysign(max(0.0, abs(free) - most), free)
            self.place += self.speed * STEP


class Stage:
    """Both axes, and the lines that they obey."""

    def __init__(self, friction: tuple[float, float] = (1.0, 1.0)) -> None:
        self.axes = [Axis(3.0, friction[0]), Axis(1.2, friction[1])]
        self.state, self.ms = "O", 0

    def advance_to(self, ms: int) -> None:
        """Advances its time."""
        while self.ms < ms:
            self.ms += 1
            for axis in self.axes:
                axis.period(self.state != "O")

    def obey(self, line: bytes) -> bytes:
        """Returns the answer to a line, without its end."""
        match line.split():
            case [b"V?"]:
                return b"V STAGE 2 SIM"
            case [b"P?"]:
                axes = (b" %d %d %d" % (axis.counts, axis.goal, axis.pwm) for axis in self.axes)
                return b"P %d %s" % (self.ms, self.state.encode()) + b"".join(axes)
            case [b"H" | b"G" as word]:
                for axis in self.axes:
                    axis.goal = axis.counts
                if word == b"G" or self.state == "R":
                    self.state = "R" if word == b"G" else "H"
                return b"OK"
            case [b"M1" | b"M2" as word, goal] if goal.isdigit():
                if self.state != "R" or int(goal) >= 4096:
                    return b"E 3" if self.state != "R" else b"E 2"
                self.axes[int(word[1:]) - 1].goal = int(goal)
                return b"OK"
        return b"E 1"


def main() -> None:
    """Serves one stage until it is interrupted."""
    parser = argparse.ArgumentParser(description="A simulated stage on a pseudo-terminal.")
    parser.add_argument("link", type=Path, help="a symbolic link to the pseudo-terminal")
    parser.add_argument("--friction", default="1,1", help="factors of both axes' friction")
    given = parser.parse_args()
    first, second = map(float, given.friction.split(","))
    stage, (host, device) = Stage((first, second)), pty.openpty()
    tty.setraw(device)
    given.link.unlink(missing_ok=True)
    given.link.symlink_to(os.ttyname(device))
    print(f"the stage is at {given.link}", flush=True)
    zero, rest = time.monotonic(), b""
    while True:
        readable, _, _ = select.select([host], [], [], 0.02)
        stage.advance_to(int(1000 * (time.monotonic() - zero)))
        if readable:
            *lines, rest = (rest + os.read(host, 4096)).split(b"\r")
            os.write(host, b"".join(stage.obey(line) + b"\r" for line in lines))


if __name__ == "__main__":
    main()
