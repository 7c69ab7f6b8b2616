"""The robot in its owner process: controller, state of the arm, and reports to the client."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from daq.contracts.experiment import Gain
from daq.contracts.limits import Limits
from daq.contracts.limp import limp_joints
from daq.contracts.machine import Machine
from daq.contracts.service.robot import Activity
from daq.contracts.trace import TraceEvent
from daq.driver import BoardSnapshot
from daq.driver.controller import ControllerStatus
from daq.owner.guardian import Guardian
from daq.owner.inbox import Inbox
from daq.owner.messages import ArmReport, Open, TeachingText
from daq.owner.speaker import Speaker
from daq.owner.watched_controller import SampleMaker, WatchedController
from daq.runner.arm_control import ArmControl
from daq.safety import State
from daq.teaching.controller_arm import ControllerArm

REPORT_EVERY = 1.0
"""Time (s) between two reports of an unchanged state."""


@dataclass
class OwnedRobot:
    """One connected robot in its owner process."""

    opening: Open
    controller: WatchedController
    control: ArmControl
    guardian: Guardian
    inbox: Inbox
    speaker: Speaker
    activity: Activity = "none"
    gains: dict[int, Gain] = field(default_factory=dict)
    _stop: tuple[int, int, float] = (0, -1, 0.0)
    """Number of the board's newest stop; count of stops that this process had sent when it was read; time of reading
    (s)."""
    _told: ArmReport | None = None
    _told_at: float = 0.0

    def __post_init__(self) -> None:
        self.samples = SampleMaker(self.machine, self.controller.period_s)

        def listen(snapshot: BoardSnapshot) -> None:
            self.speaker.say(self.samples.sample(snapshot, time.monotonic()))
            self.report_arm()

        def lost(count: int, tick: int) -> None:
            message = f"{count} samples between two activities are not shown: the bridge no longer had them"
            self.speaker.happened(TraceEvent(time=0.0, kind="missing", message=message, tick=tick))

        if self.opening.live:
            self.controller.listener, self.controller.lost = listen, lost

    @property
    def machine(self) -> Machine:
        """The machine at the port."""
        return self.opening.machine

    @property
    def limits(self) -> Limits:
        """The limits of this machine."""
        return self.opening.limits

    def end_cause(self) -> str | None:
        """Returns why the running work must end; None if it need not."""
        cause = self.guardian.cause
        return None if cause is None else cause.value

    def arm(self) -> ControllerArm:
        """Returns the controller as an arm that can be taught."""
        return ControllerArm(self.controller, self.control, self.machine, self.end_cause)

    def read_gains(self) -> dict[int, Gain]:
        """Reads the gains of the machine's joints, and stores them to report limp joints."""
        count = len(self.machine.joints)
        self.gains = {joint: gain for joint, gain in self.controller.gains().items() if joint <= count}
        return self.gains

    @property
    def newest_stop(self) -> int | None:
        """Number of the board's newest stop; None if there has been another stop since it was read."""
        number, freezes, read = self._stop
        return None if freezes != self.control.freezes or self.guardian.is_older_than_stop(read) else number

    def number_stop(self) -> None:
        """Reads the number of the newest stop if it is unknown. For an arm that is not idle, reads it once per second,
        since another host may stop it again without a trace in the samples. Raises LinkError."""
        due = self.control.arm.state is not State.IDLE and time.monotonic() - self._stop[2] >= REPORT_EVERY
        if due or self.newest_stop is None:
            self.read_status()

    def read_status(self) -> ControllerStatus:
        """Reads the board's status; the next report contains the number of its newest stop. Raises LinkError."""
        now, freezes = time.monotonic(), self.control.freezes
        status = self.controller.status()
        self._stop = (status.stop, freezes, now)
        return status

    def say(self, line: str) -> None:
        """Reports a line to the person who teaches the arm."""
        self.speaker.say(TeachingText(text=line))

    def report_arm(self, *, anew: bool = False) -> None:
        """Reports the arm's state if it has changed, once per second, or, with `anew`, always."""
        if not self.opening.live:
            return
        report = self.report()
        if anew or report != self._told or self._due():
            self._told, self._told_at = report, time.monotonic()
            self.speaker.say(report)

    def report(self) -> ArmReport:
        """Returns the present state of the arm and of the link. Counters are from the last report until the next is
        due."""
        arm, ended = self.control.arm, self.end_cause()
        # The arm counts as stopped even before the board has confirmed it:
        stopping = ended is not None and arm.connected and arm.state is not State.FAULT
        counters = self.controller.counters.numbers() if self._due() else (self._told.counters if self._told else {})
        return ArmReport(
            arm="stopped" if stopping else arm.state.value,
            cause="; ".join(part for part in (arm.cause or ended, self.control.unconfirmed) if part),
            activity=self.activity,
            limp=tuple(limp_joints(self.gains)),
            link=self.controller.link.state.value,
            counters=counters,
            stop=self.newest_stop,
            unheard=self.guardian.socket_problem,
        )

    def _due(self) -> bool:
        return time.monotonic() - self._told_at >= REPORT_EVERY
