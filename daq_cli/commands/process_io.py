"""`daq io`: process inputs and outputs, and the gripper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from daq.contracts.errors import ReachError, SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, print_json
from daq_cli.robot.access import robot_of

app = typer.Typer(add_completion=False, help="Process inputs and outputs, and the gripper.", no_args_is_help=True)
OUTPUTS = 8
WhileStoppedOption = Annotated[
    bool, typer.Option("--while-stopped", help="Switch even while the arm is stopped: it may hold a load.")
]


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Read all inputs and outputs."""
    found = robot_of(context).process()
    inputs, outputs = _bits(found.inputs), _bits(found.outputs)
    if json:
        print_json({"inputs": inputs, "outputs": outputs, "gripper": found.gripper})
        return
    print(f"inputs  {inputs:08b}\noutputs {outputs:08b}\ngripper {found.gripper}")


@app.command("set")
def set_output(
    context: typer.Context,
    output: Annotated[int, typer.Argument(help="Number of the output, 0 to 7.")],
    value: Annotated[str, typer.Argument(help="on or off.")],
    yes: YesOption = False,
    while_stopped: WhileStoppedOption = False,
) -> None:
    """Switch one process output, and read it back."""
    if not 0 <= output < OUTPUTS:
        raise SpecError(f"output {output}: allowed are 0 to {OUTPUTS - 1}")
    if value not in ("on", "off"):
        raise SpecError(f"output {output} {value!r}: allowed are on and off")
    consent = ConsentPrompt(yes, f"its output {output} will be switched {value}", "its outputs change")
    found = robot_of(context).set_output(output, on=value == "on", while_stopped=while_stopped, consent=consent)
    _print_switched(f"output {output}", value, "on" if found.outputs[output] else "off")


@app.command()
def gripper(
    context: typer.Context,
    value: Annotated[str, typer.Argument(help="open or close.")],
    yes: YesOption = False,
    while_stopped: WhileStoppedOption = False,
) -> None:
    """Open or close the gripper, and read it back."""
    if value not in ("open", "close"):
        raise SpecError(f"gripper {value!r}: allowed are open and close")
    closed = value == "close"
    consent = ConsentPrompt(yes, f"its gripper will {value}", "its gripper moves")
    found = robot_of(context).set_gripper(closed=closed, while_stopped=while_stopped, consent=consent)
    _print_switched("gripper", "closed" if closed else "open", found.gripper)


def _print_switched(what: str, wanted: str, found: str) -> None:
    """Raises ReachError."""
    if found != wanted:
        raise ReachError(f"{what}: written as {wanted}, read back as {found}")
    print(f"{what} {found}, read back")


def _bits(signals: Sequence[bool]) -> int:
    """Converts signals to a number, in which signal 0 is the lowest bit."""
    return sum(on << bit for bit, on in enumerate(signals))
