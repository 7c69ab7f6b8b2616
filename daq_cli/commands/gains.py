"""`daq gains`: the controller's PID gains."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.contracts.limp import limp_line, require_no_jump
from daq_cli.app.consent import require_consent
from daq_cli.app.context import JsonOption, YesOption, console, invocation, print_json
from daq_cli.app.quantities import parse_gains
from daq_cli.robot.local_robot import connected
from firmware_protocol.requests import SetGains

app = typer.Typer(add_completion=False, help="Show or set the controller's PID gains.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """P, I and D of every joint (0-20; not the physical gains)."""
    call = invocation(context)
    if call.server is None:
        with connected(call) as controller:
            found = controller.gains()
    else:
        from daq_cli.robot.remote.robot import remote_robot

        with remote_robot(call) as robot:
            found = robot.gains().gains
    if json:
        print_json({joint: dict(zip("pid", gain, strict=True)) for joint, gain in found.items()})
        return
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
        SetGains(joint, *gain)  # raises outside its range: all or nothing is written
    call = invocation(context)
    if call.server is not None:
        from daq_cli.robot.remote.control import set_gains_at_server

        set_gains_at_server(call, wanted, yes)
        return
    with connected(call) as controller:
        require_consent(
            call.port,
            simulated=controller.identity.simulated,
            consent=yes,
            what="its gains will change",
            refused="its gains change",
        )
        readings = controller.next_snapshot().joints
        require_no_jump({joint: reading.error for joint, reading in readings}, wanted)
        for joint, (p, i, d) in wanted.items():
            controller.set_gains(joint, p, i, d)
            print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
        limp = limp_line(controller.gains())
    if limp:
        console().print(limp)
