"""`daq gains`: the controller's PID gains."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.context import JsonOption, invocation, print_json
from daq.cli.quantities import parse_gains
from daq.cli.robot import connected

app = typer.Typer(add_completion=False, help="Show or set the controller's PID gains.", no_args_is_help=True)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """P, I and D of every joint (0-20; not the physical gains)."""
    with connected(invocation(context)) as controller:
        found = controller.gains()
    if json:
        print_json({joint: dict(zip("pid", gain, strict=True)) for joint, gain in found.items()})
        return
    for joint, (p, i, d) in found.items():
        print(f"joint {joint}: P {p:2d}  I {i:2d}  D {d:2d}")


@app.command("set")
def set_gains(
    context: typer.Context, gains: Annotated[str, typer.Argument(help="P/I/D of joints, such as 1=2/0/0,3=4/0/1.")]
) -> None:
    """Write gains and read them back. An arm off its set point may move when its gains change."""
    wanted = parse_gains(gains)
    with connected(invocation(context)) as controller:
        for joint, (p, i, d) in wanted.items():
            controller.set_gains(joint, p, i, d)
            print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
