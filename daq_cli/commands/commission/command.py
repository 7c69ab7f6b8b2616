"""`daq commission`: guides through the first day with an arm, step by step; it can be ended and gone on with."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq.contracts.experiment import parse_joints
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, JsonOption, YesOption, console, invocation, print_json
from daq_cli.commands.commission.bench import MAP, Bench, Commissioner
from daq_cli.commands.commission.by_hand import release_if_pressed
from daq_cli.commands.commission.record import Record
from daq_cli.commands.commission.sheet import write_sheet
from daq_cli.commands.commission.steps import STEPS, Step, lacking, resting_on, stale, step_named

app = typer.Typer(add_completion=False)


@app.command()
def commission(
    context: typer.Context,
    folder: Annotated[Path, typer.Option(help="Folder of the arm: its record, files and page.")] = Path(),
    only: Annotated[str | None, typer.Option(help="Do this step alone, again if it is done.")] = None,
    skip: Annotated[list[str] | None, typer.Option(help="Leave this step out; may be repeated.")] = None,
    joints: Annotated[str, typer.Option(help="Joints whose potentiometers and gains are measured.")] = "1-3",
    postures: Annotated[int, typer.Option(help="Postures at which each potentiometer is read.", min=5, max=50)] = 6,
    mock_control: Annotated[
        str | None, typer.Option(help="Control port of a mock, which then stands in for the person at the arm.")
    ] = None,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Commission an arm: line, memory map, potentiometers, stop, period, gains, first ramps, model.

    Every result is kept at once; a step that is done is not done again. Nothing moves without your word."""
    call = invocation(context)
    if call.port_option is None and call.settings.robot.port is None:
        raise SpecError("no robot is configured: give --port, or set robot.port in daq.toml (`daq ports` lists ports)")
    if not folder.is_dir():
        raise SpecError(f"folder {folder}: there is none; make it first")
    record = Record.of(folder)
    left_out = {step_named(name).name for name in skip or ()}
    if only and only in left_out:
        raise SpecError(f"--only {only} --skip {only}: nothing would be done")
    if "memory" in left_out and not (folder / MAP).exists():
        raise SpecError(f"--skip memory: {folder / MAP} is not there, and nothing may rely on an assumed memory map")
    if only:
        step_named(only)
    with _person(call, mock_control) as person:
        bench = Bench(call, folder, person, ConsentPrompt(yes), record, parse_joints(joints), postures)
        release_if_pressed(bench)
        if gone := record.drop(stale(bench)):
            _say_dropped(gone, "the port, the memory map or the machine file has changed")
        chosen = [step_named(only)] if only else [step for step in STEPS if step.name not in record.steps]
        for step in chosen:
            if step.name in left_out:
                record.keep(step.name, {"skipped": True})
                continue
            if missing := lacking(step, record):
                raise SpecError(f"step {step.name}: first do {', '.join(missing)}")
            _carry_out(bench, step)
    page = write_sheet(record)
    if json:
        print_json({"page": page, "steps": record.steps})
    else:
        print(page)


def _carry_out(bench: Bench, step: Step) -> None:
    """One step: what it does, what to watch, how to stop; then its result is kept, and the page written anew."""
    number = 1 + [one.name for one in STEPS].index(step.name)
    console().print(f"\n{number} of {len(STEPS)}: {step.title}")
    console().print(f"    {step.does} Watch: {step.watch} To stop: {step.stop}.")
    if not bench.operator.may_begin(at_the_arm=step.at_the_arm, yes=bench.consent.given):
        return
    release_if_pressed(bench)
    bench.record.drop([step.name])
    if gone := bench.record.drop(resting_on([step.name])):
        _say_dropped(gone, f"{step.name} is done again")
    result = step.run(bench)
    bench.record.keep(step.name, {**result, "basis": bench.basis()})
    for name, value in result.items():
        if not isinstance(value, dict):
            console().print(f"    {name.replace('_', ' ')}: {value}")
    write_sheet(bench.record)


def _say_dropped(names: list[str], why: str) -> None:
    console().print(f"To be done again, for {why}: {', '.join(names)}")


@contextmanager
def _person(call: Invocation, mock_control: str | None) -> Iterator[Commissioner]:
    """The person at the terminal, or a mock's stand-in."""
    if mock_control is None:
        from daq_cli.robot.terminal_operator import TerminalOperator

        yield TerminalOperator()
        return
    from daq_cli.robot.mock_hand import IN_REAL_TIME, ControlPortArm, MockOperator

    arm = ControlPortArm(mock_control)
    try:
        yield MockOperator(arm, call.settings.machine(), IN_REAL_TIME, arm.postures())
    finally:
        arm.close()
