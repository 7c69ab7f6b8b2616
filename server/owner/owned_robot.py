"""What the parts of the owner share: the robot, its state, who listens, and how all that is told."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path

from daq.acquisition.guardian import Guardian
from daq.acquisition.speaker import Speaker
from daq.contracts.experiment import Gain
from daq.contracts.limits import Limits
from daq.contracts.limp import limp_joints
from daq.contracts.machine import Machine
from daq.contracts.service.robot import Activity
from daq.driver import BoardSnapshot
from daq.runner import ArmControl
from daq.safety import State
from daq.teaching.controller_arm import ControllerArm
from server.owner.inbox import Inbox
from server.owner.messages import ArmReport, TeachingText
from server.owner.watched_controller import SampleMaker, WatchedController

REPORT_EVERY = 1.0
"""s between two reports of the arm's state when nothing changes."""


@dataclass
class OwnedRobot:
    """One connected robot in its owner's process."""

    name: str
    machine: Machine
    limits: Limits
    folder: Path
    controller: WatchedController
    control: ArmControl
    guardian: Guardian
    inbox: Inbox
    speaker: Speaker
    activity: Activity = "none"
    gains: dict[int, Gain] = field(default_factory=dict)
    _told: ArmReport | None = None
    _told_at: float = 0.0

    def __post_init__(self) -> None:
        maker = SampleMaker(self.machine, self.controller.period_s)

        def listen(snapshot: BoardSnapshot) -> None:
            self.speaker.say(maker.sample(snapshot, time.monotonic()))
            self.tell_arm()

        self.controller.listener = listen

    def ended(self) -> str | None:
        """Why somebody wants the end of what runs; None while nobody does."""
        cause = self.guardian.cause
        return None if cause is None else cause.value

    def arm(self) -> ControllerArm:
        """The controller as an arm that can be taught."""
        return ControllerArm(self.controller, self.control, self.machine, self.ended)

    def read_gains(self) -> dict[int, Gain]:
        """Of the machine's joints; remembered for `limp`."""
        count = len(self.machine.joints)
        self.gains = {joint: gain for joint, gain in self.controller.gains().items() if joint <= count}
        return self.gains

    def say(self, line: str) -> None:
        """A line for whoever teaches."""
        self.speaker.say(TeachingText(text=line))

    def tell_arm(self, *, anew: bool = False) -> None:
        """The arm's state, when it has changed, or nobody has been told for a second; or `anew` in any case."""
        arm, ended = self.control.arm, self.ended()
        # Also before the board has confirmed it:
        stopping = ended is not None and arm.connected and arm.state is not State.FAULT
        counters = self.controller.counters.numbers() if self._due() else (self._told.counters if self._told else {})
        report = ArmReport(
            arm="stopped" if stopping else arm.state.value,
            cause=arm.cause or ended or "",
            activity=self.activity,
            limp=tuple(limp_joints(self.gains)),
            link=self.controller.link.state.value,
            counters=counters,
        )
        if anew or report != self._told or self._due():
            self._told, self._told_at = report, time.monotonic()
            self.speaker.say(report)

    def _due(self) -> bool:
        return time.monotonic() - self._told_at >= REPORT_EVERY
