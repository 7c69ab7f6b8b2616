"""The status of a robot, every value with its age."""

from __future__ import annotations

from datetime import UTC

from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import LinkStatus, RobotStatus
from daq.owner.seen import link_of, sample_of
from server.robot.robot import Robot


def status_of(robot: Robot, control: Control, queue: QueueStatus) -> RobotStatus:
    """Returns the status of `robot` now, with who has control and the state of its queue."""
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
