"""The services of one robot, and the conditions of its requests.

`status_of` returns the status of a robot, every value with its age.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC

from daq.contracts.consent import lacks_consent
from daq.contracts.service.audit import AuditNote
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import LinkStatus, RobotStatus
from daq.owner.seen import link_of, sample_of
from server.access.caller import Caller
from server.catalogue.catalogue import Catalogue
from server.event_log import EventLog
from server.experiments.review import Given
from server.jobs.models import Models
from server.jobs.service import JobService
from server.live.hub import Hub
from server.problems import ProblemError, conflict, not_found
from server.queue.service import QueueService
from server.robot.control import ControlService
from server.robot.keeper import Keeper
from server.robot.robot import Robot
from server.robot.stop import StopService
from server.robot.teaching import TeachingService, Word


def status_of(robot: Robot, control: Control, queue: QueueStatus) -> RobotStatus:
    """Returns the present status of `robot`, with the holder of control and the state of its queue."""
    arm, seen = robot.arm, robot.arm_seen
    now, utc = robot.clock.monotonic(), robot.clock.utc()
    connected = robot.identity is not None
    link = LinkStatus(state="none")
    if arm is not None and seen is not None and robot.identity is not None:
        link = link_of(arm, now - seen.at, robot.place.url, robot.identity)
    return RobotStatus(
        robot=robot.name,
        machine=robot.machine.name,
        port=robot.place.url,
        connection=robot.connection,
        connection_problem="" if connected else robot.problem,
        identity=robot.identity,
        arm=arm.arm if arm is not None and connected else "disconnected",
        cause=arm.cause if arm is not None and connected else "",
        stop=arm.stop if arm is not None and connected else None,
        activity=arm.activity if arm is not None else "none",
        experiment=robot.experiment,
        limp=arm.limp if arm is not None else (),
        sample=None if robot.sample is None else sample_of(robot.sample.report, now, utc.timestamp()),
        link=link,
        control=control,
        queue=queue,
        utc=utc.astimezone(UTC),
    )


@dataclass(frozen=True)
class RobotServices:
    """The services of one robot."""

    robot: Robot
    keeper: Keeper
    stop: StopService
    control: ControlService
    queue: QueueService
    catalogue: Catalogue
    teaching: TeachingService
    hub: Hub
    jobs: JobService
    models: Models
    events: EventLog
    unattended: bool
    jogged: Callable[[AuditNote], None]
    """Informs plug-ins of a jog command."""
    owners: tuple[str, ...] = ()
    """Names of this robot's owners; empty: every owner."""

    def status(self) -> RobotStatus:
        """The status of the robot now."""
        return status_of(self.robot, self.control.status(), self.queue.status())

    def record_event(self, kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
        """Records an event of this robot. Never raises."""
        self.events.record(self.robot.name, kind, text, actor=actor, experiment=experiment)

    def record_event_later(self, kind: str, text: str, *, actor: str | None = None) -> None:
        """Does the same on a thread, for callers that must not wait for the disk."""
        self.events.record_later(self.robot.name, kind, text, actor=actor)

    def require_motion(self, lease: str | None) -> None:
        """Raises a 409 unless this lease has control now and, for a real arm, the operator's consent."""
        self.require_consent(self.control.require(lease).moves_real_arm, "take control again, with moves_real_arm")

    def require_consent(self, given: bool, advice: str) -> None:
        """Raises a 409 if the robot is a real arm and the operator's consent is not given."""
        if lacks_consent(self.robot.identity, given):
            line = f"{self.robot.place.url} is a real arm: it moves only with the operator's consent"
            raise conflict("consent-needed", line, advice)

    def require_own(self, caller: Caller, owner: str, what: str) -> None:
        """Raises a 403 unless the caller owns `what`, or is an owner of this robot."""
        if caller.name != owner and not caller.owns(self.owners):
            line = f"{what} is {owner}'s: an operator changes and cancels only their own"
            advice = f"ask {owner}, or an owner of the robot; everybody who may see the robot may stop it"
            raise ProblemError(403, "owner-needed", line, advice)

    def approval(self, caller: Caller, content: str) -> Given:
        """Returns the caller's approval of some content. Raises a 403 for callers without a token, who may be the
        author, and if only owners of the robot may approve; a 409 if no approval is needed."""
        reviewer, is_owner = self.queue.review.reviewer, caller.owns(self.owners)
        if reviewer is None:
            line = f"experiments of {self.robot.name} need no approval"
            raise conflict("no-review", line, "they begin without; the key `review` of the robot's configuration")
        if reviewer == "owner" and not is_owner:
            line = f"an owner of {self.robot.name} must approve its experiments, and {caller.name} is none"
            raise ProblemError(403, "owner-needed", line, "ask an owner of the robot")
        if caller.token is None:  # this caller may have submitted the experiment with a token, which cannot be excluded
            line = "a user of this computer without a token may be the person who submitted the experiment"
            raise ProblemError(403, "own-experiment", line, "approve it with a token, or sign in on the page")
        return Given(content, caller.name, is_owner)

    def word(self, lease: str | None, said: float) -> Word:
        """Returns the request of a client with this lease to move the arm by hand."""
        return Word(said, lambda: self.require_motion(lease))


def robot_named(robots: Sequence[RobotServices], name: str) -> RobotServices:
    """Returns the services of a robot. Raises a 404."""
    found = next((rig for rig in robots if rig.robot.name == name), None)
    if found is None:
        raise not_found(f"robot {name!r:.60}", f"this service has {', '.join(rig.robot.name for rig in robots)}")
    return found
