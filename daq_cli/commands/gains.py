"""`daq gains`: the controller's PID gains."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.contracts.limp import limp_line
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, console, print_json
from daq_cli.app.quantities import parse_gains
from daq_cli.robot.access import robot_of
from firmware_protocol.commands import SetGains

app = typer.Typer(add_completion=False, help="Show or set the controller's PID gains.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """P, I and D of every joint (0-20; not the physical gains)."""
    found = robot_of(context).gains()
    if json:
        print_json({joint: dict(zip("pid", gain, strict=True)) for joint, gain in found.items()})
        return
    if not found:
        print("the robot's memory map has no gains: they stay as they are")
    for joint, (p, i, d) in found.items():
        print(f"joint {joint}: P {p:2d}  I {i:2d}  D {d:2d}" + ("" if p else "   LIMP: nothing holds it"))


@app.command("set")
def set_gains(
    context: typer.Context,
    gains: Annotated[str, typer.Argument(help="P/I/D of joints, such as 1=2/0/0,3=4/0/1.")],
    yes: YesOption = False,
) -> None:
    """Write gains and read them back. Refused for a joint off its set point, which would jump there."""
    wanted = parse_gains(gains)
    for joint, gain in wanted.items():
        SetGains(joint, *gain)  # raises for a value outside its range, so that all gains are written or none
    consent = ConsentPrompt(yes, what="its gains will change", refused="its gains change")
    found = robot_of(context).set_gains(wanted, consent)
    for joint in wanted:
        p, i, d = found[joint]
        print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
    if limp := limp_line(found):
        console().print(limp)
