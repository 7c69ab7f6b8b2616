"""`daq io`: process inputs and outputs, and the gripper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import DaqError, SafetyError, SpecError
from daq_cli.app.consent import require_consent
from daq_cli.app.context import Invocation, JsonOption, YesOption, invocation, print_json
from daq_cli.robot.local_robot import connected

if TYPE_CHECKING:
    from daq.driver import Controller

app = typer.Typer(add_completion=False, help="Process inputs and outputs, and the gripper.", no_args_is_help=True)
BITS = 8
WhileStoppedOption = Annotated[
    bool, typer.Option("--while-stopped", help="Also on an arm that has been stopped: it may hold a load.")
]


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Read all inputs and outputs."""
    inputs, outputs, gripper = _read(invocation(context))
    if json:
        print_json({"inputs": inputs, "outputs": outputs, "gripper": gripper})
        return
    print(f"inputs  {inputs:08b}\noutputs {outputs:08b}\ngripper {gripper}")


@dataclass(frozen=True)
class SwitchConsent:
    """What the operator has said beforehand about a switching: `what` will happen, which is what is `refused`."""

    consent: bool
    while_stopped: bool
    what: str
    refused: str


class NotSwitchedError(DaqError):
    """The controller reads back something else than was written."""

    exit_code = 3


@app.command("set")
def set_output(
    context: typer.Context,
    output: Annotated[int, typer.Argument(help="Number of the output, 0 to 7.")],
    value: Annotated[str, typer.Argument(help="on or off.")],
    yes: YesOption = False,
    while_stopped: WhileStoppedOption = False,
) -> None:
    """Switch one process output, and read it back."""
    if not 0 <= output < BITS:
        raise SpecError(f"output {output}: allowed are 0 to {BITS - 1}")
    if value not in ("on", "off"):
        raise SpecError(f"output {output} {value!r}: allowed are on and off")
    call, on = invocation(context), value == "on"
    asked = SwitchConsent(yes, while_stopped, f"its output {output} will be switched {value}", "its outputs change")
    if call.server is not None:
        from daq_cli.robot.remote.control import set_output_at_server

        found = set_output_at_server(call, output, on=on, asked=asked).outputs[output]
    else:
        with _allowed(call, asked) as controller:
            controller.write_outputs(1 << output, on << output)
            found = bool(controller.process().outputs >> output & 1)
    _tell(f"output {output}", value, "on" if found else "off")


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
    call, closed = invocation(context), value == "close"
    asked = SwitchConsent(yes, while_stopped, f"its gripper will {value}", "its gripper moves")
    if call.server is not None:
        from daq_cli.robot.remote.control import set_gripper_at_server

        found = set_gripper_at_server(call, closed=closed, asked=asked).gripper == "closed"
    else:
        with _allowed(call, asked) as controller:
            controller.set_gripper(closed=closed)
            found = bool(controller.process().gripper)
    _tell("gripper", "closed" if closed else "open", "closed" if found else "open")


@contextmanager
def _allowed(call: Invocation, asked: SwitchConsent) -> Iterator[Controller]:
    """The controller of an arm that may be switched now.

    Raises SafetyError without the operator's word on a real arm, and for one that has been stopped, also while the
    operator was asked: nobody holds the port meanwhile, so that a stop gets through.
    """
    with connected(call) as controller:
        _require_not_stopped(controller, asked)
        simulated = controller.identity.simulated
        if simulated or asked.consent:
            yield controller
            return
    require_consent(call.port, simulated=simulated, consent=asked.consent, what=asked.what, refused=asked.refused)
    with connected(call) as controller:
        _require_not_stopped(controller, asked)
        yield controller


def _require_not_stopped(controller: Controller, asked: SwitchConsent) -> None:
    from firmware_protocol.commands import StatusFlag

    if StatusFlag.FROZEN in controller.status().flags and not asked.while_stopped:
        raise SafetyError("the arm has been stopped: `daq reset` first, or --while-stopped; nothing was switched")


def _tell(what: str, wanted: str, found: str) -> None:
    """Raises NotSwitchedError."""
    if found != wanted:
        raise NotSwitchedError(f"{what}: written as {wanted}, read back as {found}")
    print(f"{what} {found}, read back")


def _read(call: Invocation) -> tuple[int, int, str]:
    """Inputs and outputs, bit 0 the first one, and the gripper."""
    if call.server is None:
        with connected(call) as controller:
            here = controller.process()
        return here.inputs, here.outputs, "closed" if here.gripper else "open"
    from daq_cli.robot.remote.robot import remote_robot

    with remote_robot(call) as robot:
        there = robot.process()
    return _bits(there.inputs), _bits(there.outputs), there.gripper


def _bits(signals: Sequence[bool]) -> int:
    return sum(on << bit for bit, on in enumerate(signals))
