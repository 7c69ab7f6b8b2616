"""The status of a robot, every value with its age."""

from __future__ import annotations

from datetime import UTC

from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import LinkStatus, RobotStatus, Sample
from daq.runner.line_status import with_rates
from daq.transport import parse_port_url
from daq.transport.endpoint import BITS_PER_BYTE
from firmware_protocol.codes import StatusFlag
from server.robot.robot import Robot, Seen


def status_of(robot: Robot, control: Control, queue: QueueStatus) -> RobotStatus:
    """Returns the status of `robot` now, with who has control and the state of its queue."""
    arm, seen = robot.arm, robot.arm_seen
    now, utc = robot.clock.monotonic(), robot.clock.utc()
    connected = robot.identity is not None
    link = LinkStatus(state="none")
    if arm is not None and seen is not None and connected:
        link = LinkStatus(state=arm.link, counters=arm.counters, age=now - seen.at)
        if robot.identity is not None:
            port = parse_port_url(robot.place.url)
            link = with_rates(link, port.baud / BITS_PER_BYTE, robot.identity)
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
        sample=sample_of(robot.sample, now, utc.timestamp()),
        link=link,
        control=control,
        queue=queue,
        utc=utc.astimezone(UTC),
    )


def sample_of(seen: Seen | None, now: float, utc: float) -> Sample | None:
    """Converts a sample to what clients get. `now` (monotonic) and `utc` (wall clock) are the same time (s)."""
    if seen is None:
        return None
    sample = seen.report
    age = now - sample.host_time
    return Sample(
        tick=sample.tick,
        host_time=sample.host_time,
        utc=utc - age,
        age=age,
        joints=sample.joints,
        set_point=sample.set_point,
        position=sample.position,
        error=sample.error,
        drive=sample.drive,
        frozen=bool(sample.status & StatusFlag.FROZEN.value),
    )
