"""`daq view`: a trace in Rerun, or live samples of a service in Rerun or Foxglove."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Protocol

import typer

from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.contracts.machine import Machine
from daq.contracts.service.live import SampleMessage
from daq_cli.app.context import console, invocation
from daq_cli.robot.access import robot_of

app = typer.Typer(add_completion=False)


class LiveView(Protocol):
    """Shows live samples."""

    def sample(self, sample: SampleMessage, utc: float) -> None:
        """Shows a sample, taken at `utc` (s since 1970)."""
        ...

    def close(self) -> None:
        """Ends the view."""
        ...


class Viewer(StrEnum):
    """Programs that can show it."""

    RERUN = "rerun"
    FOXGLOVE = "foxglove"


@app.command()
def view(
    context: typer.Context,
    trace: Annotated[str | None, typer.Argument(help="Trace to show in Rerun; without it, live samples.")] = None,
    to: Annotated[Viewer, typer.Option(help="Program that shows it.")] = Viewer.RERUN,
    save: Annotated[Path | None, typer.Option(help="Write a file of Rerun (.rrd) instead of starting it.")] = None,
    urdf: Annotated[Path | None, typer.Option(help="The robot's URDF with its meshes, for Rerun.")] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the server for Foxglove.")] = 8765,
) -> None:
    """Show a trace in Rerun, or the live samples of a service (--server) in Rerun or Foxglove.

    Foxglove opens traces by itself: they are MCAP files with joint states. Ctrl-C ends a live view. The viewer of Rerun
    tells its makers how it is used, unless `rerun analytics disable` was run.
    """
    require_extra(to.value, f"--to {to.value}", "rerun" if to is Viewer.RERUN else "foxglove")
    call = invocation(context)
    if trace is not None:
        if to is Viewer.FOXGLOVE:
            raise SpecError(f"{trace}: open the file in Foxglove; only live samples need --to foxglove")
        _show(context, trace, save, urdf)
    elif call.server is None:
        raise SpecError("name a trace, or a service with --server URL: `daq serve` starts one")
    else:
        _live(context, to, save, urdf, port)


def _show(context: typer.Context, wanted: str, save: Path | None, urdf: Path | None) -> None:
    from daq.traces.files import open_trace
    from extras.views.rerun_view import RerunView, names_of

    robot = robot_of(context)
    path = robot.find_trace(robot.call.trace_folder, wanted)
    trace = open_trace(path, robot.call.trace_limits)
    with TemporaryDirectory() as folder:
        shown = RerunView(path.stem, names_of(trace), save, urdf or _own_urdf(trace.record.machine, Path(folder)))
        shown.trace(trace)
        shown.close()


def _own_urdf(machine: Machine | None, folder: Path) -> Path | None:
    """Writes the frames of a machine as a URDF; returns None if it has no geometry."""
    from extras.formats.robot_files.urdf_writer import urdf_text
    from model.machine_model.model import base_model

    if machine is None:
        return None
    try:
        text, _ = urdf_text(base_model(machine))
    except SpecError:
        return None
    path = folder / f"{machine.name}.urdf"
    path.write_text(text, "utf-8")
    return path


def _live(context: typer.Context, to: Viewer, save: Path | None, urdf: Path | None, port: int) -> None:
    from daq.contracts.machine import joint_names
    from daq_cli.robot.remote.connection import remote_robot

    with remote_robot(invocation(context)) as robot:
        machine = robot.machine()
        names = joint_names(machine, tuple(range(1, len(machine.joints) + 1)))
        shown: LiveView
        if to is Viewer.RERUN:
            from extras.views.rerun_view import RerunView

            shown = RerunView(machine.name, names, save, urdf)
        else:
            from extras.views.foxglove_view import FoxgloveView

            shown = server = FoxgloveView(machine.name, names, port)
            console().print(f"Foxglove: open connection, {server.url}", markup=False)
        try:
            with robot.live("samples") as stream:
                for frame in stream:
                    for message in frame.messages:
                        if message.topic == "sample":
                            shown.sample(message, frame.utc - (frame.now - message.host_time))
        except KeyboardInterrupt:
            console().print("ended")
        finally:
            shown.close()
