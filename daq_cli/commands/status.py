"""`daq status`: shows posture, state and link of the robot."""

from __future__ import annotations

import typer

from daq.contracts.limp import limp_line
from daq_cli.app.context import JsonOption, print_json, printable
from daq_cli.robot.access import robot_of

app = typer.Typer(add_completion=False)


@app.command()
def status(context: typer.Context, json: JsonOption = False) -> None:
    """Posture, state and link of the robot, read once; --json has the same fields here and at a server."""
    from daq.contracts.joint_text import position_text
    from daq.owner.seen import rates_line

    robot = robot_of(context)
    found = robot.state()
    report = found.report
    if json:
        print_json(report.model_dump(mode="json"))
        return
    print(printable(found.headline))
    if (one := report.sample) is not None:
        names = {joint: f"{joint} {printable(robot.machine.joint(joint).name)}:" for joint in one.joints}
        wide = max(map(len, names.values()), default=0)
        for joint, *angles in zip(one.joints, one.position, one.set_point, one.error, strict=True):
            position, set_point, error = (position_text(robot.machine, joint, one) for one in angles)
            print(f"  joint {names[joint]:{wide}} {position:>9s}   set point {set_point:>9s}   error {error:>7s}")
    if line := rates_line(report.link):
        print(line)
    if (queue := report.queue) is not None:
        state = f"paused: {queue.reason}" if queue.paused else "open"
        runs = f"; {queue.running} runs" if queue.running else ""
        print(printable(f"queue {state}; {queue.queued} waiting{runs}"))
    if (control := report.control) is not None:
        print(printable(f"control: {control.name if control.holder == 'client' else control.holder}"))
    if report.limp:
        print(limp_line(found.gains))
