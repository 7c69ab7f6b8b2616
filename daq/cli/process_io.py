"""`daq io`: process inputs and outputs, and the gripper."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.context import JsonOption, invocation, print_json
from daq.cli.robot import connected
from daq.contracts.errors import SpecError

app = typer.Typer(add_completion=False, help="Process inputs and outputs, and the gripper.", no_args_is_help=True)
BITS = 8


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Read all inputs and outputs."""
    with connected(invocation(context)) as controller:
        found = controller.process()
    if json:
        print_json({"inputs": found.inputs, "outputs": found.outputs, "gripper": "closed" if found.gripper else "open"})
        return
    print(f"inputs  {found.inputs:08b}\noutputs {found.outputs:08b}\ngripper {'closed' if found.gripper else 'open'}")


@app.command("set")
def set_output(
    context: typer.Context,
    output: Annotated[int, typer.Argument(help="Number of the output, 0 to 7.")],
    value: Annotated[str, typer.Argument(help="on or off.")],
) -> None:
    """Switch one process output."""
    if not 0 <= output < BITS:
        raise SpecError(f"output {output}: allowed are 0 to {BITS - 1}")
    if value not in ("on", "off"):
        raise SpecError(f"output {output} {value!r}: allowed are on and off")
    with connected(invocation(context)) as controller:
        controller.write_outputs(1 << output, (value == "on") << output)


@app.command()
def gripper(context: typer.Context, value: Annotated[str, typer.Argument(help="open or close.")]) -> None:
    """Open or close the gripper."""
    if value not in ("open", "close"):
        raise SpecError(f"gripper {value!r}: allowed are open and close")
    with connected(invocation(context)) as controller:
        controller.set_gripper(closed=value == "close")
