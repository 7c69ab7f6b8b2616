"""Carries out an experiment for the command line: dry run, consent, progress, result."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import SafetyError, SpecError
from daq_cli.app.consent import agreed, can_be_asked
from daq_cli.app.context import Invocation, console, print_json
from daq_cli.app.stop_keys import StopKeys

if TYPE_CHECKING:
    from rich.progress import Progress

    from daq.acquisition.messages import Failed, Finished, Job
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.machine import Machine


def carry_out(
    call: Invocation, spec: ExperimentSpec, *, folder: Path | None, dry_run: bool, consent: bool, as_json: bool
) -> Finished | None:
    """Runs `spec` as this invocation says, prints the result, and ends with its exit code unless it is complete.

    Returns None for a dry run.
    """
    if dry_run:
        preview(spec, call.machine, as_json)
        return None
    finished = acquire(call, spec, call.machine, folder or call.trace_folder, consent)
    if as_json:
        print_json(finished.model_dump(mode="json"))
    else:
        print_result(finished)
    if finished.outcome != "complete":
        raise typer.Exit(exit_codes.OF_OUTCOME[finished.outcome])
    return finished


def acquire_whole(call: Invocation, spec: ExperimentSpec, machine: Machine, folder: Path, consent: bool) -> Finished:
    """As `acquire`, for what is made of whole runs alone: an incomplete one is an AcquisitionFailedError, too."""
    finished = acquire(call, spec, machine, folder, consent)
    if finished.outcome != "complete":
        why = f"{finished.outcome}: {finished.reason}" if finished.reason else finished.outcome
        raise AcquisitionFailedError(
            f"{why}; the run is not complete, so its trace is not used", exit_codes.OF_OUTCOME[finished.outcome]
        )
    return finished


def acquire(call: Invocation, spec: ExperimentSpec, machine: Machine, folder: Path, consent: bool) -> Finished:
    """Runs `spec` in an acquisition process, or at the server, showing its progress; Ctrl-C freezes the arm.

    Where a real arm waits for consent and a person can be asked, asks. Raises AcquisitionFailedError.
    """
    if call.server is not None:
        from daq_cli.robot.remote.run import acquire_remotely

        return acquire_remotely(call, spec, folder, consent)
    from daq.acquisition.messages import Finished, Job
    from daq.transport import parse_port_url

    if not str(folder).isprintable():
        raise SpecError(f"folder {str(folder)!r}: a trace's folder has a name of printable characters")
    parse_port_url(call.port)  # a port that is none needs no process to say so
    job = Job(
        url=call.port,
        machine=machine,
        limits=machine.limits,
        spec=spec,
        folder=folder,
        robot=call.settings.robot.name,
        memory_map=call.memory_map_text,
        moves_real_arm=consent,
    )
    end = _shown(job)
    if not isinstance(end, Finished) and end.needs_consent and can_be_asked():
        if not agreed(job.url):
            raise AcquisitionFailedError("not agreed: nothing moved", end.exit_code)
        end = _shown(job.model_copy(update={"moves_real_arm": True}))
    if not isinstance(end, Finished):
        raise AcquisitionFailedError(end.message, end.exit_code)
    return end


def _shown(job: Job) -> Finished | Failed:
    """One acquisition process, its progress and events on the terminal; Ctrl-C and its like are passed on as a stop."""
    from daq.acquisition import messages
    from daq.acquisition.parent import Acquisition

    with StopKeys() as keys, Acquisition(job) as process, shown_run(job.spec) as shown:
        keys.stops(process.stop)
        for report in process:
            if isinstance(report, messages.Progress):
                shown.progress(report.fraction, report.text)
            elif isinstance(report, messages.EventHappened):
                shown.event(report.event.kind, report.event.time, report.event.message)
            elif isinstance(report, messages.Finished | messages.Failed):
                return report
    raise AssertionError("an acquisition always ends with a report")


class ShownRun:
    """A run as it goes on: a bar, and a line for each event above it."""

    def __init__(self, bar: Progress, kind: str, quiet: frozenset[str]) -> None:
        self._bar = bar
        self._quiet = quiet
        self._task = bar.add_task(kind, total=1.0, text="connecting")

    def progress(self, fraction: float, text: str) -> None:
        """How far it is."""
        from rich.markup import escape

        self._bar.update(self._task, completed=fraction, text=escape(text))

    def event(self, kind: str, time: float, message: str) -> None:
        """Something that is in the trace too; `time` in s from the start of the record."""
        from rich.markup import escape

        if kind not in self._quiet:
            line = escape(f"{kind.replace('_', ' ')}: {message}")
            self._bar.console.print(f"[dim]{time:8.2f} s[/dim]  {line}", soft_wrap=True, markup=True)


@contextmanager
def shown_run(spec: ExperimentSpec) -> Iterator[ShownRun]:
    """Shows a run within; the bar is gone when it is done, and is not there where nobody watches."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    kind = spec.trajectory.kind
    # A sequence has dozens of marks; they are in the trace.
    marks = {"note", "ramp_start", "ramp_end", "reversal"} if kind == "sequence" else set()
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[text]}"), TimeElapsedColumn())
    with Progress(*columns, console=console(), transient=True, disable=not console().is_terminal) as bar:
        yield ShownRun(bar, kind, frozenset({"start", "end"} | marks))


class AcquisitionFailedError(SafetyError):
    """What the acquisition process reported instead of a trace, with its own exit code."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]


def preview(spec: ExperimentSpec, machine: Machine, as_json: bool) -> None:
    """What the motion would be, and what speaks against it. Raises SafetyError when something does."""
    from daq.safety import check_plan, unchecked
    from daq.trajectories import plan, start_angles

    motion = plan(spec, machine, start_angles(spec, machine))
    shown = motion.preview()
    violations = check_plan(motion, machine, machine.limits)
    if as_json:
        print_json({"preview": shown.as_data(), "violations": [str(v) for v in violations]})
    else:
        every = f"every {shown.period * 1e3:g} ms"
        print(f"{spec.trajectory.kind}: {shown.duration:.2f} s, {shown.set_points} set points {every}")
        for joint in shown.joints:
            if joint.moves:
                angles = [math.degrees(a) for a in (joint.start, joint.end, joint.lowest, joint.highest)]
                print(
                    f"  joint {joint.joint}: {angles[0]:.2f}° → {angles[1]:.2f}°, between {angles[2]:.2f}° and "
                    f"{angles[3]:.2f}°, at most {math.degrees(joint.top_speed):.1f}°/s"
                )
        for line in unchecked(machine, machine.limits):
            print(f"  {line}")
    if violations:
        raise SafetyError(f"refused: {'; '.join(map(str, violations))}")
    if not as_json:
        print("  nothing speaks against it; nothing was sent")


def print_result(finished: Finished) -> None:
    """The end of a run, for people."""
    counters = finished.counters
    print(f"{finished.outcome}: {finished.samples} samples, {finished.missing} missing" + (
        f" — {finished.reason}" if finished.reason else ""
    ))  # fmt: skip
    told = ("retries", "damaged", "torn", "missed_set_points", "restarts")
    print("link: " + ", ".join(f"{name.replace('_', ' ')} {counters.get(name, 0):.0f}" for name in told))
    print(f"trace: {finished.trace}")
