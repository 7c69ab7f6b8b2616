"""`daq memory`: finds the registers in the memory that the motor controller shares with its host."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import ReachError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, JsonOption, YesOption, console, invocation, print_json

if TYPE_CHECKING:
    from extras.commissioning.memory.commands import CommandProof
    from extras.commissioning.memory.findings import Findings
    from extras.commissioning.memory.procedure import Operator
    from extras.commissioning.memory.watch import WatchedByte
    from extras.commissioning.person.memory_page import LinkPage

WINDOW = 200
"""Number of past readings in the live table."""
ROW = 16

app = typer.Typer(add_completion=False, help="Watch the shared memory, and find its registers.", no_args_is_help=True)


@app.command()
def watch(
    context: typer.Context,
    seconds: Annotated[float | None, typer.Option(help="End after this time (default: Ctrl-C).", min=0.1)] = None,
    once: Annotated[bool, typer.Option("--once", help="Read for a second, print one table, and end.")] = False,
    json: JsonOption = False,
) -> None:
    """Show every byte live: which change, how fast, and together with which others. Only reads."""
    from extras.commissioning.memory.watch import watched

    call = invocation(context)
    length = seconds if seconds is not None else 1.0 if once or json or not console().is_terminal else None
    with _page(call) as page:
        readings = deque([page.read()], maxlen=None if once or json else WINDOW)
        begun = readings[0].time_s
        live = console().is_terminal and not (once or json)
        try:
            with _screen(live) as show:
                while length is None or readings[-1].time_s - begun < length:
                    readings.append(page.read())
                    if live:
                        show(_watch_text(watched(page.base, list(readings))))
        except KeyboardInterrupt:
            if not live:
                raise
        found = watched(page.base, list(readings))
    if json:
        period = readings[-1].time_s - readings[0].time_s
        print_json({"seconds": period, "readings": len(readings), "bytes": [one.as_data() for one in found]})
    else:
        print(_watch_text(found))


@app.command()
def find(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", help="File for the memory map.")] = Path("memory_map.toml"),
    findings: Annotated[Path, typer.Option(help="File for every finding with its evidence (.json).")] = Path(
        "memory_findings.json"
    ),
    commands: Annotated[
        bool, typer.Option("--commands/--no-commands", help="Prove set points by the smallest steps, at the end.")
    ] = True,
    inputs: Annotated[bool, typer.Option("--inputs/--no-inputs", help="Ask for process inputs to be switched.")] = True,
    mock_control: Annotated[
        str | None, typer.Option(help="Control port of a mock, which then acts as the person at the arm.")
    ] = None,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Find positions, set points, errors, powers, gains and inputs, with evidence. Asks you to move the arm by hand.
    Writes only set points at proved addresses, and these only at the end. If the search ends while the emergency stop
    is pressed, this is noted beside the memory map, and the next call begins with the safe release."""
    from daq.config.robot_files import load_memory_map
    from daq_cli.app.output_file import check_folder
    from extras.commissioning.command.record import Record
    from extras.commissioning.person.person_at import person_at
    from extras.commissioning.person.safe_release import release_after_interruption

    for path, what in ((output, "memory map"), (findings, "findings")):
        check_folder(path, what)
    call, record = invocation(context), Record.of(output.absolute().parent)
    _require_robot(call)
    with person_at(call, mock_control) as operator:
        if record.stop_pressed:
            known = output if output.exists() else call.settings.robot.memory_map
            memory_map = load_memory_map(known)
            release_after_interruption(call.port, operator, memory_map, output.exists(), record.note_stop)
        with _page(call) as page:
            new_map, new_findings = until_complete(output, findings, operator)
            found, proofs = search(
                call,
                page,
                operator,
                ConsentPrompt(yes),
                new_findings,
                inputs=inputs,
                commands=commands,
                when_found=lambda found: keep_map(found, new_map),
                pressed=record.note_stop,
            )
    written = adopt(found, {new_map: output, new_findings: findings})
    if json:
        print_json(
            findings_data(found, proofs)
            | {"memory_map": str(output) if written else None, "absent": list(found.absent())}
        )
        return
    print(findings_text(found, proofs))
    print(f"findings: {findings if written else new_findings}")
    print(f"memory map: {output}" if written else why_no_map(found, output))
    if written and (absent := what_is_absent(found, output)):
        print(absent)


def search(
    call: Invocation,
    page: LinkPage,
    operator: Operator,
    consent: ConsentPrompt,
    keep: Path,
    *,
    inputs: bool,
    commands: bool,
    when_found: Callable[[Findings], object],
    pressed: Callable[[bool], None],
) -> tuple[Findings, list[CommandProof]]:
    """Runs the whole search; writes the findings so far to `keep` after every stage that changes them.

    when_found: called with the findings before anything is moved
    pressed:    called when the emergency stop is about to be pressed, and when it was released safely
    """
    from daq_cli.app.output_file import replacing
    from extras.commissioning.memory.findings import judge
    from extras.commissioning.memory.procedure import Finder, Task
    from extras.commissioning.person.pressed import EmergencyStop

    def save(found: Findings, proofs: list[CommandProof]) -> None:
        import json

        with replacing(keep) as part:
            part.write_text(json.dumps(findings_data(found, proofs), indent=2) + "\n", "utf-8")

    proofs: list[CommandProof] = []
    with EmergencyStop(operator, pressed) as stop:
        finder = Finder(
            page,
            operator,
            inputs=5 if inputs else 0,
            keep=lambda recording: save(judge(recording), []),
            pressed=stop.tell,
        )
        found = finder.find()
        save(found, [])
        when_found(found)
        if commands:
            consent.require(call.port, page)
            if stop.pressed and _released(page, operator, found):
                stop.tell(False)
            if not stop.pressed and page.release_freeze(lambda: operator.begin(Task("end_freeze"))):
                proofs = _prove(page, operator, found)
    save(found, proofs)
    return found, proofs


def _released(page: LinkPage, operator: Operator, found: Findings) -> bool:
    """Returns whether the emergency stop was released, and the arm has not moved."""
    from extras.commissioning.memory.procedure import errors_now, is_alive, may_have_power, release

    def against() -> str:
        if not is_alive(page.read().data):
            return "the memory is not live"
        return may_have_power(errors_now(page, found.joints))

    if why := release(page, operator, against):
        operator.show(f"Nothing is moved: {why}.")
    return not why


def _prove(page: LinkPage, operator: Operator, found: Findings) -> list[CommandProof]:
    """Proves by command, joint by joint, each with the person's consent; does nothing if the arm might jump."""
    from extras.commissioning.memory.commands import prove_by_command
    from extras.commissioning.memory.procedure import Task, errors_now, may_have_power

    proofs: list[CommandProof] = []
    for joint in found.joints:
        place = None if joint.set_point is None else joint.set_point.place
        if place is None or not operator.begin(Task("command", joint=joint.joint)):
            continue
        if against := may_have_power(errors_now(page, found.joints)):
            operator.show(f"Nothing more is moved; use the emergency stop: {against}.")
            break
        page.prove([page.base + place.low])
        proofs.append(prove_by_command(page, found.joints, joint.joint))
        operator.show(proof_line(proofs[-1]))
        if proofs[-1].problem:
            operator.show("The proof ends here. Keep a hand at the emergency stop.")
            break
    return proofs


def keep_map(found: Findings, path: Path) -> bool:
    """Writes the memory map, and if a register has no place also a map to be completed.

    Returns whether there is a memory map: False while a register that every map needs has no place.
    """
    from daq_cli.app.output_file import replacing
    from extras.commissioning.memory.findings import begun_map_text
    from firmware_protocol.memory_map import memory_map_text

    memory_map = found.memory_map("found at this arm")
    if found.missing() or memory_map is None:
        with replacing(begun_map(path)) as part:
            part.write_text(begun_map_text(found), "utf-8")
    if memory_map is None:
        return False
    remarks = ['Found by `daq memory find`. "found": by evidence at the arm; "assumed": agrees with all readings.']
    if absent := found.absent():
        remarks.append(f"Left out, because they have no place: {', '.join(absent)}. Nothing reads or writes them.")
    with replacing(path) as part:
        part.write_text(memory_map_text(memory_map, remarks), "utf-8")
    return True


def until_complete(path: Path, findings: Path, operator: Operator) -> tuple[Path, Path]:
    """Returns the files to which a search writes its map and findings.

    Without an earlier map, the final files, so that nothing is lost. Otherwise files beside them: the earlier ones stay
    if this search ends early, and the person is told so.
    """
    if not path.exists():
        return path, findings
    new_map, new_findings = (one.with_name(f"{one.stem}.new{one.suffix}") for one in (path, findings))
    operator.show(
        f"{path.name} and {findings.name} stay as they are until this search is complete. If it ends early, its "
        f"results are in {new_map.name} and {new_findings.name}: save them under the first names to use them."
    )
    for one in (new_map, begun_map(new_map), new_findings):
        one.unlink(missing_ok=True)  # of an earlier search that ended early
    return new_map, new_findings


def adopt(found: Findings, files: Mapping[Path, Path]) -> bool:
    """Replaces the earlier result by that of a complete search; returns whether there is a memory map.

    Without one the earlier result stays. `files`: new file → final name.
    """
    new_map, path = next(iter(files.items()))
    if found.memory_map("") is None:
        keep_map(found, path)  # only writes the map to be completed
        return False
    for new, one in files.items():
        new.replace(one)
    if begun_map(new_map).exists():
        begun_map(new_map).replace(begun_map(path))
    return True


def begun_map(path: Path) -> Path:
    """Returns the path of the map to be completed, beside a memory map."""
    return path.with_suffix(".begun.toml")


def why_no_map(found: Findings, path: Path) -> str:
    """Says which registers have no place, and what to do."""
    names = found.essential()
    why = f"these have no place: {', '.join(names)}" if names else "errors of some joints have two bytes, of others one"
    return (
        f"no memory map: {why}; {begun_map(path).name} has all others: replace its question marks with the "
        f"addresses from your manual, and save it as {path.name}"
    )


def what_is_absent(found: Findings, path: Path) -> str:
    """Says what the memory map leaves out, and the consequences; empty if it is complete."""
    absent = found.absent()
    if not absent:
        return ""
    gains = any(name.startswith("gain") for name in absent)
    lost = ["gains can be neither read nor set: the arm keeps its own"] if gains else []
    if any(not name.startswith("gain") for name in absent):
        lost.append("process signals and the gripper are not available")
    return (
        f"{path.name} leaves out {', '.join(absent)}, which have no place, so {'; '.join(lost)}. Nothing reads or "
        f"writes them. With a manual: replace the question marks of {begun_map(path).name} with the addresses, and "
        f"save it as {path.name}"
    )


def findings_data(found: Findings, proofs: list[CommandProof]) -> dict[str, object]:
    """Returns everything as plain data."""
    from dataclasses import asdict

    return {
        "base": f"{found.base:04X}",
        "size": found.size,
        "findings": [one.as_data() for one in found.all],
        "free_running": [f"{address:04X}" for address in found.free_running],
        "unchanged": {f"{address:04X}": value for address, value in found.unchanged},
        "proved_by_command": [asdict(proof) for proof in proofs],
    }


def findings_text(found: Findings, proofs: list[CommandProof]) -> str:
    """Returns one line for every register, and the results of the proof by command."""
    lines = []
    for one in found.all:
        name = one.register if one.joint is None else f"{one.register} {one.joint}"
        high = "" if one.high is None else f" {one.high:04X}"
        where = "" if one.low is None else f"{one.low:04X}{high}"
        lines.append(f"{name:<15} {one.verdict:<12} {where:<10} {one.evidence}")
    lines += [proof_line(proof) for proof in proofs]
    return "\n".join(lines)


def proof_line(proof: CommandProof) -> str:
    """Returns one joint's proof as a line for people."""
    if proof.problem:
        return f"joint {proof.joint}: NOT PROVED by command: {proof.problem}"
    towards = {1: "towards it: the sign of its drive is right", 0: "not far enough to show the sign of its drive"}
    return (
        f"joint {proof.joint}: its set point moved by {proof.step} units, its error followed, "
        f"the joint moved by {proof.moved:+.0f} counts {towards[proof.sign]}"
    )


def _watch_text(found: list[WatchedByte]) -> str:
    """Returns the page in rows of 16, then every byte that changes."""
    values = {one.address: one for one in found}
    first = found[0].address - found[0].address % ROW
    lines = ["     " + " ".join(f" {column:X}" for column in range(ROW)) + "   columns that change"]
    for start in range(first, found[-1].address + 1, ROW):
        shown = [values.get(start + column) for column in range(ROW)]
        row = "".join("   " if one is None else f" {one.value:02X}" for one in shown)
        marks = "".join(" " if one is None or not one.changes else f"{one.address % ROW:X}" for one in shown)
        lines.append(f"{start:04X} {row}   {marks}")
    for one in found:
        if one.changes:
            together = ", ".join(f"{address:04X}" for address in one.together)
            lines.append(
                f"{one.address:04X}  {one.value:3d}  {one.lowest:3d} to {one.highest:3d}  {one.rate:5.1f} changes/s"
                + (f"  with {together}" if together else "")
            )
    return "\n".join(lines)


@contextmanager
def _screen(live: bool) -> Iterator[Callable[[str], None]]:
    """Yields a function that shows text in place, in a terminal."""
    if not live:
        yield lambda _text: None
        return
    from rich.live import Live

    with Live(console=console(), auto_refresh=False, screen=True) as display:
        yield lambda text: display.update(text, refresh=True)


@contextmanager
def _page(call: Invocation) -> Iterator[LinkPage]:
    """Opens the memory of the configured robot. Raises ReachError if there is none."""
    from daq.config.robot_files import load_memory_map
    from extras.commissioning.person.memory_page import open_page

    _require_robot(call)
    with open_page(call.port, load_memory_map(call.settings.robot.memory_map)) as page:
        yield page


def _require_robot(call: Invocation) -> None:
    if call.port_option is None and call.settings.robot.port is None:
        raise ReachError("no robot is configured: give --port, or set robot.port in daq.toml (`daq config show`)")
