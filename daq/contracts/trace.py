"""A recorded experiment in memory: its specification, measured signals, times and metadata."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from daq.contracts import tables
from daq.contracts.errors import SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, ReportedGain
from daq.contracts.extras import require_extra
from daq.contracts.frozen import FrozenRecord
from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleCount
from daq.contracts.sketch import html_of, name_of
from daq.contracts.with_arrays import WithArrays

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TRACE_FORMAT = 2
"""Version of a trace's metadata and topics; a reader refuses newer versions."""

BY_JOINT = ("position", "set_point", "error", "drive", "velocity", "power_raw")
"""Signals of a trace with a column for each joint."""

EventKind = Literal[
    "start",  # of the record
    "ramp_start",  # of any motion
    "ramp_end",
    "reversal",  # the motion changes direction
    "waypoint",  # a named moment of the motion: a via point, a repeat, the ends of a slow move
    "gains",  # changed for this run, or restored
    "limit",  # a set point waits for a joint at its following-error limit
    "pause",  # set points wait
    "resume",  # set points continue
    "retry",  # the link repeated requests
    "missing",  # samples that were not delivered
    "missed_set_point",  # sent in time, but the controller could not read it; sent late: LATE_SET_POINTS
    "restart",  # of the board
    "link_lost",
    "stop",
    "fault",
    "note",
    "end",  # of the record
]


SLOW_LINE = "slow line: "
"""Prefix of the note that not every control period is sampled."""
INCOMPLETE = "INCOMPLETE: "
"""Prefix of the note about data that an imported file announces but lacks."""
LATE_SET_POINTS = "late_set_points"
"""Counter of the control periods that used an older set point than the one sent for them. A record lacks it if the
number is unknown."""


LATE_WORDS = "set points taken a period late, or not at all"


def late_set_points_line(count: float) -> str:
    """Returns the warning text for `count` late set points."""
    return (
        f"{count:.0f} {LATE_WORDS}: they were sent late, so the motion was "
        "played with a jolt there; is the computer busy?"
    )


EARLIEST, LATEST = datetime(1970, 1, 1, tzinfo=UTC), datetime(2262, 1, 1, tzinfo=UTC)
"""Range of moments that fit into 64 bits of ns since 1970, as time stamps are written."""


def _stamped_by_64_bits(moment: datetime) -> datetime:
    """Raises ValueError for a moment outside EARLIEST to LATEST."""
    # Compare, do not convert: `astimezone` overflows near the year 9999.
    aware = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    if not EARLIEST <= aware < LATEST:
        raise ValueError("must be a time of the years 1970 to 2261")
    return moment


Moment = Annotated[datetime, AfterValidator(_stamped_by_64_bits)]
"""A time at which a trace can have been recorded."""


class TraceEvent(FrozenRecord):
    """An event during the record. `time` is in s from the start of the record."""

    time: float
    kind: EventKind
    message: str
    tick: int | None = None
    joint: int | None = None


class TraceRecord(FrozenRecord):
    """Metadata of a trace: the metadata record at the start of the file and, at its end, the outcome."""

    format: Annotated[int, Field(le=TRACE_FORMAT)] = TRACE_FORMAT
    trace_id: str
    created: Moment
    """Start of the record in UTC, `time` = 0."""
    software: str
    source: Literal["mock", "real", "imported"]
    robot: str = "ma2000"
    operator: str | None = None
    machine: Machine | None = None
    memory_map: dict[str, object] | None = None
    joint_names: Annotated[tuple[str, ...], Field(exclude_if=lambda names: not names)] = ()
    """Joint names of an imported file, in the order of the columns; empty if it has none."""
    columns: Annotated[dict[str, str], Field(exclude_if=lambda columns: not columns)] = {}
    """Source columns of each signal in an imported table; empty for all other files."""
    where: Annotated[str, Field(exclude_if=lambda where: not where)] = ""
    """The condition that selected the rows of an imported file; empty for all rows."""
    joints_chosen: Annotated[bool, Field(exclude_if=lambda chosen: not chosen)] = False
    """Whether a person gave the order of the joints, so that names may differ from the machine's."""
    spec: ExperimentSpec | None = None
    gains: dict[int, ReportedGain] | None = None
    """P, I, D of each joint, as reported by the controller."""
    period: float | None = None
    """Control period (s); None if the record has no control periods."""
    every: Annotated[int, Field(ge=1, exclude_if=lambda every: every == 1)] = 1
    """Control periods from one sample to the next: more than one on a slow line."""
    drive_unit: Literal["V", "A", "N·m", "N"] | None = None
    clock: dict[str, float] = {}
    """Offsets between the board's ticks, the host's monotonic clock and UTC, in s."""
    notes: str = ""
    outcome: Outcome | None = None
    counters: dict[str, float] = {}
    """The link's counters at the end of the record."""


@dataclass(frozen=True, eq=False)
class Trace(WithArrays):
    """Signals of n samples on the joints `joints` (numbers from 1), one column each, in that order.

    time:      (n,)   s from the start of the record, strictly increasing
    position:  (n, j) rad (m on a prismatic joint)
    set_point: (n, j) rad (m), as the controller used it in that period; None if not recorded
    error:     (n, j) rad (m), set point − position, as computed by the controller
    drive:     (n, j) motor volts after the amplifier, or the unit in `record.drive_unit`: A, N·m, N. Positive drive
                      increases the angle (with a negative gear ratio, decreases it)
    velocity:  (n, j) rad/s (m/s)
    power_raw: (n, j) the controller's output before the amplifier, DAC counts
    tick:      (n,)   number of the control period; a step that skips a sample (`SampleCount`) is a gap
    host_time: (n,)   s, the host's monotonic clock when the sample arrived
    status:    (n,)   the board's flags (`firmware_protocol.commands.StatusFlag`)
    taken:     (n,)   number of the first control period that used the sample's set points, 0 if unknown. None if every
                      period was sampled: the set point is then seen in the sample itself
    file:             path as given by the user, for messages; empty if unknown

    Raises TraceError if shapes disagree, time does not increase, or a value is not finite.
    """

    record: TraceRecord
    joints: tuple[int, ...]
    time: Floats
    position: Floats
    set_point: Floats | None = None
    error: Floats | None = None
    drive: Floats | None = None
    velocity: Floats | None = None
    power_raw: Integers | None = None
    tick: Integers | None = None
    host_time: Floats | None = None
    status: Integers | None = None
    taken: Integers | None = None
    events: tuple[TraceEvent, ...] = field(default=())
    file: str = field(default="", compare=False)

    def __repr__(self) -> str:
        """One line, for notebooks: arrays of all signals would fill the page."""
        record = self.record
        span = f"{self.time[-1] - self.time[0]:.1f} s" if len(self.time) else "0 s"
        joints = ", ".join(map(str, self.joints))
        return f"<Trace {record.trace_id}: {name_of(self)}, {len(self.time)} samples in {span}, joints {joints}>"

    def _repr_html_(self) -> str:
        """HTML for notebooks: facts and a small picture."""
        return html_of(self)

    def plot(self, joints: tuple[int, ...] | None = None, *, ax: Axes | None = None) -> Figure:
        """Plots the trace, one column per joint: the joints that the experiment moves, unless `joints` names others. On
        given axes (`ax`), plots positions only, with dashed set points.

        Raises TraceError for a joint that the trace lacks, and for a trace without samples; MissingExtraError.
        """
        from daq.contracts.figure import figure_of

        require_extra("robot", "plot()", "matplotlib")
        if len(self) == 0:
            raise TraceError(f"{self.called}: has no samples to plot")
        return figure_of(self, joints, ax)

    def to_pandas(self) -> pd.DataFrame:
        """Returns a table with one row per sample, indexed by time (s); units in `attrs`. Raises MissingExtraError."""
        return tables.to_pandas(self)

    def to_xarray(self) -> xr.Dataset:
        """Returns arrays over time and joint, with units and metadata as attributes. Raises MissingExtraError."""
        return tables.to_xarray(self)

    def __post_init__(self) -> None:
        count = len(self.time)
        if not self.joints or len(set(self.joints)) != len(self.joints):
            raise TraceError(f"{self.called}: joints {self.joints} are not one or more different joints")
        for name in BY_JOINT:
            signal = getattr(self, name)
            if signal is not None and signal.shape != (count, len(self.joints)):
                wanted = (count, len(self.joints))
                raise TraceError(f"{self.called}: {name} has shape {signal.shape}, expected {wanted}")
            if signal is not None and not np.isfinite(signal).all():
                row = int(np.argwhere(~np.isfinite(signal))[0][0])
                raise TraceError(f"{self.called}: {name} is not finite at sample {row}")
        if not np.isfinite(self.time).all() or (count > 1 and not (np.diff(self.time) > 0).all()):
            raise TraceError(f"{self.called}: time must be finite and strictly increasing")
        for name in ("tick", "host_time", "status", "taken"):
            signal = getattr(self, name)
            if signal is not None and signal.shape != (count,):
                raise TraceError(f"{self.called}: {name} has shape {signal.shape}, expected {(count,)}")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def called(self) -> str:
        """Name of the trace in messages: its file if known, else its ID."""
        return self.file or f"trace {self.record.trace_id}"

    @property
    def missing(self) -> int:
        """Number of missing samples between the first and the last."""
        return sum(lost for _, lost in self.gaps)

    @property
    def drive_unit(self) -> str:
        """Unit of the drive for people. Old recordings state none; they are in volts."""
        return self.record.drive_unit or ("V" if self.record.source != "imported" else "unit not stated")

    @property
    def has_ticks(self) -> bool:
        """Whether control periods are counted, so that missing samples are detected."""
        return self.tick is not None

    @property
    def missing_text(self) -> str:
        """Text about missing samples; without ticks, about the times between samples."""
        if self.tick is not None or len(self) < 2:
            return f"{self.missing} missing"
        steps = np.diff(self.time)
        usual, longest = float(np.median(steps)), int(steps.argmax())
        line = f"usually {usual:.4g} s apart, at most {steps[longest]:.4g} s (after {self.time[longest]:.4g} s)"
        return f"{line}; it has no ticks, so missing samples cannot be detected"

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """Row before each gap, and the number of samples missing in it (`SampleCount`)."""
        if self.tick is None or len(self) == 0:
            return []
        steps, every = np.diff(self.tick.astype(np.int64)), self.record.every
        if every == 1:  # a late sample then always means a missing one; fast path for long records
            rows = np.flatnonzero(steps > 1)
            return [(int(row), int(steps[row]) - 1) for row in rows]
        count = SampleCount(every)
        return [(row, lost) for row, step in enumerate(steps.tolist()) if (lost := count.missing(step))]

    def column(self, joint: int | str) -> int:
        """Returns the column of a joint: its number from 1, or its name. Raises TraceError if the trace lacks it."""
        known: Sequence[int | str] = self.record.joint_names if isinstance(joint, str) else self.joints
        if joint not in known:
            raise TraceError(f"{self.called}: joint {joint} is not recorded; the joints are {tuple(known)}")
        return known.index(joint)


Traces = Trace | Sequence[Trace]
"""One trace, or several."""


def as_sequence(traces: Traces) -> Sequence[Trace]:
    """Wraps a single trace in a tuple. Raises SpecError for anything but traces."""
    found = (traces,) if isinstance(traces, Trace) else traces
    each = found if isinstance(found, Sequence) else (found,)
    if wrong := [one for one in each if not isinstance(one, Trace)]:
        raise SpecError(f"traces: give a Trace or several, not {type(wrong[0]).__name__}; `read_trace` reads a file")
    return found
