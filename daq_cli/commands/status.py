"""`daq status`: what the robot and its link say now."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import typer

from daq.contracts.limp import limp_joints, limp_line
from daq_cli.app.context import Invocation, JsonOption, invocation, print_json
from daq_cli.robot.local_robot import connected

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.contracts.status import StatusReport
    from daq.driver import Controller

app = typer.Typer(add_completion=False)


@app.command()
def status(context: typer.Context, json: JsonOption = False) -> None:
    """Posture, state and link of the robot, read once; --json has the same fields here and at a server."""
    call = invocation(context)
    if call.server is not None:
        from daq_cli.robot.remote.status import show_status

        show_status(call, json)
        return
    machine = call.settings.machine()
    with connected(call) as controller:
        board, gains = controller.status(), controller.gains()
        report = _report(call, machine, controller, limp_joints(gains))
    if json:
        print_json(report.model_dump(mode="json"))
        return
    state = ", ".join(flag.name.lower().replace("_", " ") for flag in board.flags if flag.name) or "no flags"
    kind = "mock" if controller.identity.simulated else "REAL ARM"
    print(f"{kind}, tick {board.tick}, {state}; {board.missed} set points missed since power-up; link {board.link}")
    assert report.sample is not None
    one = report.sample
    for joint, *angles in zip(one.joints, one.position, one.set_point, one.error, strict=True):
        position, aim, error = map(math.degrees, angles)
        print(f"  joint {joint}: {position:8.2f}°   set point {aim:8.2f}°   error {error:6.2f}°")
    if report.limp:
        print(limp_line(gains))


def _report(call: Invocation, machine: Machine, controller: Controller, limp: list[int]) -> StatusReport:
    """What the board says now, as a service would say it."""
    from daq.contracts.service.robot import LinkStatus, RobotIdentity, Sample
    from daq.contracts.status import StatusReport
    from daq.runner.rows import RowMaker
    from firmware_protocol.commands import StatusFlag

    snapshot, now = controller.next_snapshot(), datetime.now(UTC)
    joints = tuple(joint for joint, _ in snapshot.joints)
    row = RowMaker(machine, joints, controller.period_s).row(snapshot)
    identity, frozen = controller.identity, StatusFlag.FROZEN in snapshot.flags
    return StatusReport(
        robot=call.settings.robot.name,
        machine=machine.name,
        port=call.port,
        connection="connected",
        identity=RobotIdentity(
            simulated=identity.simulated, protocol=identity.version, period=identity.period_s, boots=identity.boots
        ),
        arm="stopped" if frozen else "idle",
        activity="none",
        limp=tuple(limp),
        sample=Sample(
            tick=row.tick,
            host_time=row.host_time,
            utc=now.timestamp(),
            age=0.0,
            frozen=frozen,
            joints=joints,
            set_point=row.set_point,
            position=row.position,
            error=row.error,
            drive=row.drive,
        ),
        link=LinkStatus(state=controller.status().link, counters=controller.counters.numbers(), age=0.0),
        utc=now,
    )
