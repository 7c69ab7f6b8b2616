"""Traces and live samples in Rerun: signals by joint, and the robot's bodies if it has a URDF."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import rerun as rr
from rerun.urdf import UrdfJoint, UrdfTree

from daq.contracts.errors import SpecError
from daq.contracts.machine import joint_names
from daq.contracts.service.live import SampleMessage
from daq.contracts.trace import Trace

SIGNALS = ("set_point", "position", "error", "velocity", "drive")
APPLICATION = "ma2000-daq"


class RerunView:
    """A recording, shown by a viewer that it starts, or saved to a file (`save`).

    names: joints, by their numbers. Raises SpecError for an unreadable URDF.
    """

    def __init__(self, title: str, names: Sequence[str], save: Path | None = None, urdf: Path | None = None) -> None:
        self._names = tuple(names)
        self._rerun = rr.RecordingStream(APPLICATION, recording_id=title)
        if save is None:
            self._rerun.spawn()
        else:
            self._rerun.save(save)
        self._tree: UrdfTree | None = None
        if urdf is not None:
            try:
                self._tree = UrdfTree.from_file_path(urdf)
                self._tree.log_urdf_to_recording(recording=self._rerun)
            except (OSError, ValueError, RuntimeError) as error:
                raise SpecError(f"{urdf}: cannot be shown as a URDF: {error}") from error

    def trace(self, trace: Trace) -> None:
        """Shows a whole trace on the timeline `time`, in s from its start."""
        times = [rr.TimeColumn("time", duration=trace.time)]
        for column, joint in enumerate(trace.joints):
            name = self._names[joint - 1]
            for signal in SIGNALS:
                values = getattr(trace, signal)
                if values is not None:
                    self._rerun.send_columns(f"{name}/{signal}", times, rr.Scalars.columns(scalars=values[:, column]))
            if (moving := self._joint(name)) is not None:
                poses = moving.compute_transform_columns(trace.position[:, column].tolist(), clamp=False)
                self._rerun.send_columns(f"transforms/{name}", times, poses)
        for event in trace.events:
            self._rerun.set_time("time", duration=event.time)
            self._rerun.log("events", rr.TextLog(f"{event.kind}: {event.message}"))

    def sample(self, sample: SampleMessage, utc: float) -> None:
        """Shows a live sample, taken at `utc` (s since 1970)."""
        self._rerun.set_time("utc", timestamp=utc)
        for column, joint in enumerate(sample.joints):
            name = self._names[joint - 1]
            for signal in ("set_point", "position", "error", "drive"):
                self._rerun.log(f"{name}/{signal}", rr.Scalars(getattr(sample, signal)[column]))
            if (moving := self._joint(name)) is not None:
                pose = moving.compute_transform(sample.position[column], clamp=False)
                self._rerun.log(f"transforms/{name}", pose)

    def close(self) -> None:
        """Writes what waits."""
        self._rerun.flush()
        self._rerun.disconnect()

    def _joint(self, name: str) -> UrdfJoint | None:
        with suppress(KeyError, ValueError):
            return None if self._tree is None else self._tree.get_joint_by_name(name)
        return None


def names_of(trace: Trace) -> tuple[str, ...]:
    """Names of all joints up to the highest of the trace."""
    return joint_names(trace.record.machine, tuple(range(1, max(trace.joints) + 1)))
