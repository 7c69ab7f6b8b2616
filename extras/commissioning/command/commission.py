"""`daq commission`: guides through the first day with an arm, step by step; it can be interrupted and continued.

It also finds the port by unplugging the cable and plugging it in again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from daq.config.robot_files import load_memory_map
from daq.contracts.errors import ReachError, SpecError
from daq.contracts.experiment import parse_joints
from daq.transport.discovery import FoundPort, appeared, ports
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, JsonOption, YesOption, console, invocation, print_json
from extras.commissioning.command.arm import Said, begin_anew, require_same_arm
from extras.commissioning.command.bench import CONFIG, MAP, Bench
from extras.commissioning.command.by_command import end_freeze
from extras.commissioning.command.by_hand import release_if_pressed
from extras.commissioning.command.record import Record
from extras.commissioning.command.sheet import write_sheet
from extras.commissioning.command.steps import STEPS, Step, lacking, resting_on, stale, step_named
from extras.commissioning.memory.procedure import Operator, Task
from extras.commissioning.person.person_at import person_at
from extras.commissioning.person.terminal_operator import TerminalOperator

POLL_S, PATIENCE_S = 0.25, 15.0
"""Time (s) between two looks at the list of ports, and time that a port may take to appear."""


def port_by_plugging(
    operator: Operator,
    listed: Callable[[], Sequence[FoundPort]] = ports,
    wait: Callable[[float], None] = time.sleep,
) -> FoundPort:
    """Returns the port that appears when the cable is plugged in. Opens none. Raises ReachError, TransportError."""
    before = {one.url for one in listed()}
    if not operator.begin(Task("unplug")):
        raise ReachError("the cable was not unplugged, so the port is not known: give --port (`daq ports` lists them)")
    without = listed()
    if before and before <= {one.url for one in without}:  # once more: the cable may have been unplugged beforehand
        operator.begin(Task("unplug", again=f"no port disappeared, there are {', '.join(sorted(before))}"))
        without = listed()
    if not operator.begin(Task("plug_in")):
        raise ReachError("the cable was not plugged in, so the port is not known: give --port (`daq ports` lists them)")
    operator.show(f"Looking for it, up to {PATIENCE_S:.0f} s.")
    for _ in range(round(PATIENCE_S / POLL_S)):
        if (found := appeared(without, listed())) is not None:
            shown = ", ".join(text for text in (found.description, found.maker, found.serial_number) if text)
            operator.show(f"{found.url}  {shown}")
            return found
        wait(POLL_S)
    others = ", ".join(one.url for one in without) or "none"
    raise ReachError(
        f"no port appeared within {PATIENCE_S:.0f} s of plugging in (others: {others}): "
        "is it a data cable, and does the bridge have power?"
    )


app = typer.Typer(add_completion=False)


@app.command()
def commission(
    context: typer.Context,
    folder: Annotated[Path, typer.Option(help="Folder of the arm: its record, files and page.")] = Path(),
    only: Annotated[str | None, typer.Option(help="Do only this step, again if it is done.")] = None,
    skip: Annotated[list[str] | None, typer.Option(help="Leave this step out; may be repeated.")] = None,
    because: Annotated[str, typer.Option(help="Why steps are left out, for the acceptance sheet.")] = "",
    find_port: Annotated[
        bool, typer.Option("--find-port", help="Find the port by unplugging the cable and plugging it in.")
    ] = False,
    baud: Annotated[int | None, typer.Option(help="Baud rate of the port that is found.", min=300)] = None,
    arm: Annotated[
        Said | None,
        typer.Option(
            help="What to do if the arm at the port is not that of the folder: start over (new), or continue, because "
            "a part of it was exchanged (same)."
        ),
    ] = None,
    joints: Annotated[str, typer.Option(help="Joints whose potentiometers and gains are measured.")] = "1-3",
    postures: Annotated[int, typer.Option(help="Postures at which each potentiometer is read.", min=5, max=50)] = 6,
    mock_control: Annotated[
        str | None, typer.Option(help="Control port of a mock, which then acts as the person at the arm.")
    ] = None,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Commission an arm: line, memory map, potentiometers, stop, period, gains, first ramps, model.

    Every result is saved at once; a completed step is not repeated. Nothing moves without your consent.
    """
    left_out = {step_named(name).name for name in skip or ()}
    _require_sensible(folder, only, left_out, because)
    call = _with_port(invocation(context), folder, find_port=find_port, baud=baud)
    record = begin_anew(folder) if arm == "new" else Record.of(folder)
    record.operator = call.configuration.operator or record.operator
    if "memory" in left_out:
        _require_memory_map(folder / MAP)
    with person_at(call, mock_control) as person:
        bench = Bench(call, folder, person, ConsentPrompt(yes), record, parse_joints(joints), postures)
        chosen = [step_named(only)] if only else [step for step in STEPS if step.name not in record.steps]
        if any(step.at_the_port and step.name not in left_out for step in chosen):
            require_same_arm(bench, arm)
        release_if_pressed(bench)
        if gone := record.drop(stale(bench)):
            _say_dropped(gone, "the port, the memory map or the machine file has changed")
        chosen = [step_named(only)] if only else [step for step in STEPS if step.name not in record.steps]
        for step in chosen:
            if step.name in left_out:
                record.keep(step.name, {"skipped": True} | ({"reason": because} if because else {}))
                continue
            if missing := lacking(step, record):
                raise SpecError(f"step {step.name}: first do {', '.join(missing)}")
            _carry_out(bench, step)
    if all(step.name in left_out for step in chosen):
        console().print("All steps are done: --only STEP repeats one, --arm new begins with another arm")
    page = write_sheet(record)
    if json:
        print_json({"page": page, "steps": record.steps})
    else:
        print(page)


def _require_sensible(folder: Path, only: str | None, left_out: set[str], because: str) -> None:
    """Rejects inconsistent options before anything is asked or recorded. Raises SpecError, MemoryMapError."""
    if not folder.is_dir():
        raise SpecError(f"folder {folder}: does not exist; make it first")
    if only and only in left_out:
        raise SpecError(f"--only {only} --skip {only}: nothing would be done")
    if only:
        step_named(only)
    if because and not left_out:
        raise SpecError("--because: gives the reason for steps that are left out, so it needs --skip")


def _with_port(call: Invocation, folder: Path, *, find_port: bool, baud: int | None) -> Invocation:
    """Returns the invocation with the port that is found, given, configured, or in the folder's daq.toml. Raises
    SpecError."""
    if find_port:
        if call.port_option is not None:
            raise SpecError("--find-port and --port: give one of them")
        found = port_by_plugging(TerminalOperator()).url
        return replace(call, port_option=found if baud is None else f"{found}?baud={baud}")
    if baud is not None:
        raise SpecError("--baud: belongs to --find-port; a given port has it in its URL, as in ?baud=115200")
    if call.port_option is None and call.settings.robot.port is None:
        own = folder / CONFIG
        port = Invocation(config_file=own).settings.robot.port if own.exists() else None
        if port is None:
            raise SpecError(
                "no robot is configured: give --port (`daq ports` lists ports), or --find-port to find it by "
                "unplugging the cable and plugging it in"
            )
        return replace(call, port_option=port)
    return call


def _require_memory_map(path: Path) -> None:
    """Requires a valid memory map to leave out the search, before anything is recorded. Raises SpecError,
    MemoryMapError."""
    if not path.exists():
        raise SpecError(f"--skip memory: {path} does not exist, and nothing may rely on an assumed memory map")
    load_memory_map(path)


def _carry_out(bench: Bench, step: Step) -> None:
    """Does one step: says what it does, what to watch, how to stop; then saves the result and the page."""
    number = 1 + [one.name for one in STEPS].index(step.name)
    console().print(f"\n{number} of {len(STEPS)}: {step.title}")
    console().print(f"    {step.does} Watch: {step.watch} To stop: {step.stop}.")
    if not bench.operator.may_begin(at_the_arm=step.at_the_arm, yes=bench.consent.given):
        return
    release_if_pressed(bench)
    if "bridge" in step.needs and step.at_the_arm:
        end_freeze(bench)
    result = step.run(bench)
    if gone := bench.record.drop(resting_on([step.name])):  # not earlier: a failing step keeps the previous results
        _say_dropped(gone, f"{step.name} is repeated")
    bench.record.keep(step.name, {**result, "basis": bench.basis()})
    for name, value in result.items():
        if not isinstance(value, dict):
            console().print(f"    {name.replace('_', ' ')}: {value}")
    write_sheet(bench.record)


def _say_dropped(names: list[str], why: str) -> None:
    console().print(f"To be repeated, because of {why}: {', '.join(names)}")
