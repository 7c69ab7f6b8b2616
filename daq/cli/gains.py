"""`daq gains`: the controller's PID gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from daq.cli.consent import agreed
from daq.cli.context import JsonOption, YesOption, console, invocation, print_json
from daq.cli.limp import limp_line
from daq.cli.quantities import parse_gains
from daq.cli.robot import connected
from daq.contracts.errors import SafetyError

if TYPE_CHECKING:
    from firmware_protocol.commands import JointReading

app = typer.Typer(add_completion=False, help="Show or set the controller's PID gains.", no_args_is_help=True)

JUMP_WITHIN = 16
"""ADC counts of error up to which gains are written: an assumption. A limp joint that becomes stiff jumps by its whole
error, so 1° at most on joints 1 to 3; what a held joint hangs below its set point is less."""

Gain = tuple[int, int, int]


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """P, I and D of every joint (0-20; not the physical gains)."""
    with connected(invocation(context)) as controller:
        found = controller.gains()
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
    call = invocation(context)
    with connected(call) as controller:
        if not controller.identity.simulated and not yes and not agreed(call.port):
            raise SafetyError(f"{call.port} is a real arm: its gains change only with the operator's consent (--yes)")
        require_no_jump(dict(controller.next_snapshot().joints), wanted)
        for joint, (p, i, d) in wanted.items():
            controller.set_gains(joint, p, i, d)
            print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
        limp = limp_line(controller.gains())
    if limp:
        console().print(limp)


def require_no_jump(readings: Mapping[int, JointReading], wanted: Mapping[int, Gain]) -> None:
    """Raises SafetyError when a joint that gets a drive is too far from its set point."""
    far = [
        f"joint {joint} is {readings[joint].error} ADC counts"
        for joint, gain in sorted(wanted.items())
        if any(gain) and joint in readings and abs(readings[joint].error) > JUMP_WITHIN
    ]
    if far:
        raise SafetyError(
            f"gains refused: {', '.join(far)} from its set point, allowed are ±{JUMP_WITHIN}: it would jump there; "
            "hold the arm, make its posture the set points with `daq reset --here`, then set the gains; nothing changed"
        )
