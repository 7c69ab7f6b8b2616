"""`daq io`: process inputs and outputs, and the gripper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from daq.cli.context import Invocation, JsonOption, invocation, print_json
from daq.cli.robot import connected
from daq.contracts.errors import SpecError

app = typer.Typer(add_completion=False, help="Process inputs and outputs, and the gripper.", no_args_is_help=True)
BITS = 8


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Read all inputs and outputs."""
    inputs, outputs, gripper = _read(invocation(context))
    if json:
        print_json({"inputs": inputs, "outputs": outputs, "gripper": gripper})
        return
    print(f"inputs  {inputs:08b}\noutputs {outputs:08b}\ngripper {gripper}")


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
    call = invocation(context)
    if call.server is not None:
        from daq.cli.remote.control import set_output_at_server

        set_output_at_server(call, output, on=value == "on")
        return
    with connected(call) as controller:
        controller.write_outputs(1 << output, (value == "on") << output)


@app.command()
def gripper(context: typer.Context, value: Annotated[str, typer.Argument(help="open or close.")]) -> None:
    """Open or close the gripper."""
    if value not in ("open", "close"):
        raise SpecError(f"gripper {value!r}: allowed are open and close")
    call = invocation(context)
    if call.server is not None:
        from daq.cli.remote.control import set_gripper_at_server

        set_gripper_at_server(call, closed=value == "close")
        return
    with connected(call) as controller:
        controller.set_gripper(closed=value == "close")


def _read(call: Invocation) -> tuple[int, int, str]:
    """Inputs and outputs, bit 0 the first one, and the gripper."""
    if call.server is None:
        with connected(call) as controller:
            here = controller.process()
        return here.inputs, here.outputs, "closed" if here.gripper else "open"
    from daq.cli.remote.robot import remote_robot

    with remote_robot(call) as robot:
        there = robot.process()
    return _bits(there.inputs), _bits(there.outputs), there.gripper


def _bits(signals: Sequence[bool]) -> int:
    return sum(on << bit for bit, on in enumerate(signals))
