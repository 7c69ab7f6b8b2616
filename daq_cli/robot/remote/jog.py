"""Jogging a server's robot with the keys: each press drives for 0.3 s at most, so a lost line lets the arm hold."""

from __future__ import annotations

import time
from collections.abc import Callable

from daq_cli.app.context import Invocation
from daq_cli.app.keyboard import keys
from daq_cli.robot.pendant import HELP, Pendant, StatusLine
from daq_cli.robot.remote.teach import taught

LOOK_EVERY = 0.05
"""s between two looks at the keyboard."""


def jog_at_server(
    call: Invocation, pendant: Pendant, keep: Callable[[dict[int, float]], None], consent: bool, line: StatusLine
) -> None:
    """As `daq teach jog`; `keep` is given the angles (rad) of a posture to be kept.

    Raises StoppedAtServerError after Ctrl-C, and what the service refuses.
    """
    with keys() as keyboard, taught(call, consent) as (robot, control, stopped):
        line.tell(HELP)
        while not pendant.ended:
            stopped.raise_if_answered()
            typed = keyboard.pressed()
            now = time.monotonic()
            command = pendant.command(typed, now)
            if command is not None and command.time == now:  # said just now: an older one is not repeated
                control.jog(command.velocities)
            if pendant.gripper is not None:
                control.set_gripper(closed=pendant.gripper)
                pendant.gripper = None
            if pendant.keep and (sample := robot.status().sample) is not None:
                pendant.keep = False
                keep(dict(zip(sample.joints, sample.set_point, strict=True)))
            line.show(pendant)
            time.sleep(LOOK_EVERY)
        control.finish()
