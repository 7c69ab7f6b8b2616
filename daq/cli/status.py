"""`daq status`: what the robot and its link say now."""

from __future__ import annotations

import math
from dataclasses import asdict

import typer

from daq.cli.context import JsonOption, invocation, print_json
from daq.cli.robot import connected
from daq.contracts.limp import limp_joints, limp_line

app = typer.Typer(add_completion=False)


@app.command()
def status(context: typer.Context, json: JsonOption = False) -> None:
    """Posture, state and link of the robot, read once."""
    call = invocation(context)
    if call.server is not None:
        from daq.cli.remote.status import show_status

        show_status(call, json)
        return
    machine = call.settings.machine()
    with connected(call) as controller:
        found = controller.status()
        snapshot = controller.next_snapshot()
        identity = controller.identity
        gains = controller.gains()
    joints = []
    for joint, reading in snapshot.joints:
        own = machine.calibration(joint)
        angle, error = own.counts_to_rad(reading.position), own.rad_per_count * reading.error
        joints.append(
            {"joint": joint, "position": angle, "error": error, "set_point": own.posture_to_rad(reading.set_point)}
        )
    if json:
        board = {"tick": found.tick, "flags": found.flags.name, "boots": found.boots, "missed": found.missed}
        link = {"link": found.link, "counters": asdict(found.counters)}
        print_json({"simulated": identity.simulated, **board, **link, "limp": limp_joints(gains), "joints": joints})
        return
    kind = "mock" if identity.simulated else "REAL ARM"
    state = ", ".join(flag.name.lower().replace("_", " ") for flag in found.flags if flag.name) or "no flags"
    print(f"{kind}, tick {found.tick}, {state}; {found.missed} set points missed since power-up; link {found.link}")
    for row in joints:
        position, error, aim = (math.degrees(row[name]) for name in ("position", "error", "set_point"))
        print(f"  joint {row['joint']}: {position:8.2f}°   set point {aim:8.2f}°   error {error:6.2f}°")
    if limp_joints(gains):
        print(limp_line(gains))
