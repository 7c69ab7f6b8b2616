"""A recorded experiment in memory: what was asked, what was measured, when, and under which circumstances."""

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
"""Version of the trace's metadata and topics; a reader refuses newer ones. Format 1 had events and joint states in
JSON."""

BY_JOINT = ("position", "set_point", "error", "drive", "velocity", "power_raw")
"""Signals of a trace with a column for each joint."""

EventKind = Literal[
    "start",
    "ramp_start",
    "ramp_end",
    "reversal",
    "gains",
    "limit",
    "pause",
    "resume",
    "retry",
    "missing",
    "missed_set_point",
    "restart",
    "link_lost",
    "stop",
    "fault",
    "note",
    "end",
]


SLOW_LINE = "slow line: "
"""Beginning of the note that not every control period is sampled. It is shown also where other notes are not."""
INCOMPLETE = "INCOMPLETE: "
"""Beginning of the note on what an imported file promises, or once held, and does not give."""
LATE_SET_POINTS = "late_set_points"
"""Counter of the control periods that used an older set point than the one that was sent for them. A record lacks it
where that is not known."""


LATE_WORDS = "set points taken a period late, or not at all"


def late_set_points_line(count: float) -> str:
    """What set points that were sent late mean, for people; `count` of them."""
    return (
        f"{count:.0f} {LATE_WORDS}: they were sent late, so the motion was "
        "played with a jolt there; is the computer busy?"
    )


EARLIEST, LATEST = datetime(1970, 1, 1, tzinfo=UTC), datetime(2262, 1, 1, tzinfo=UTC)
"""Range of moments that fit into 64 bits of ns since 1970, as time stamps are written."""


def _stamped_by_64_bits(moment: datetime) -> datetime:
    """Raises ValueError for a moment outside of EARLIEST to LATEST."""
    # Compared and not converted: near the year 9999 a moment may have no UTC.
    aware = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    if not EARLIEST <= aware < LATEST:
        raise ValueError("a moment of the years 1970 to 2261 is expected")
    return moment


Moment = Annotated[datetime, AfterValidator(_stamped_by_64_bits)]
"""A moment at which a trace can have been recorded."""


class TraceEvent(FrozenRecord):
    """Something that happened during the record. `time` is in s from the record's start."""

    time: float
    kind: EventKind
    message: str
    tick: int | None = None
    joint: int | None = None


class TraceRecord(FrozenRecord):
    """What a trace says about itself: the metadata record at the start of the file, and at its end the outcome."""

    format: Annotated[int, Field(le=TRACE_FORMAT)] = TRACE_FORMAT
    trace_id: str
    created: Moment
    """UTC of the record's start, `time` = 0."""
    software: str
    source: Literal["mock", "real", "imported"]
    robot: str = "ma2000"
    operator: str | None = None
    machine: Machine | None = None
    memory_map: dict[str, object] | None = None
    joint_names: Annotated[tuple[str, ...], Field(exclude_if=lambda names: not names)] = ()
    """What an imported file calls the joints, in the order of the columns; empty where it does not name them."""
    columns: Annotated[dict[str, str], Field(exclude_if=lambda columns: not columns)] = {}
    """What each signal was taken from in a table of another program, by signal; empty for all other files."""
    joints_chosen: Annotated[bool, Field(exclude_if=lambda chosen: not chosen)] = False
    """Whether a person gave the order of the joints, so that names may be others than the machine's."""
    spec: ExperimentSpec | None = None
    gains: dict[int, ReportedGain] | None = None
    """P, I, D of each joint, as the controller reported them."""
    period: float | None = None
    """Control period (s); None where the record was not made tick by tick."""
    every: Annotated[int, Field(ge=1, exclude_if=lambda every: every == 1)] = 1
    """Control periods from one sample to the next: more than one where the line to the controller was slow."""
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
    set_point: (n, j) rad, as the controller took it in that period; None where the record has none
    error:     (n, j) rad, set point − position as the controller formed it
    drive:     (n, j) motor volts after the amplifier, or A, N·m, N where `record.drive_unit` says so. Positive volts
               turn the joint to larger angles, whichever way its sensor counts, unless its gear ratio is negative
    velocity:  (n, j) rad/s
    power_raw: (n, j) the controller's output before the amplifier, DAC counts
    tick:      (n,)   number of the control period; a step in which a sample is missing (`SampleCount`) is a gap
    host_time: (n,)   s, the host's monotonic clock when the sample arrived
    status:    (n,)   the board's flags (`firmware_protocol.commands.StatusFlag`)
    taken:     (n,)   number of the first control period that used the sample's set points, 0 where it is not known;
                      None where every period has a sample, which shows it
    file:             what whoever named the file calls it, for messages; empty where that is not known

    Raises TraceError when shapes disagree, time does not increase, or a value is not finite.
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
        """One line: a notebook shows it, and an array of every signal would fill the page."""
        record = self.record
        span = f"{self.time[-1] - self.time[0]:.1f} s" if len(self.time) else "0 s"
        joints = ", ".join(map(str, self.joints))
        return f"<Trace {record.trace_id}: {name_of(self)}, {len(self.time)} samples in {span}, joints {joints}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: facts and a small picture."""
        return html_of(self)

    def plot(self, joints: tuple[int, ...] | None = None, *, ax: Axes | None = None) -> Figure:
        """The figure, one column a joint: those that the experiment moves, unless `joints` names others. On axes of the
        caller's (`ax`) it draws positions alone, with the set points dashed.

        Raises TraceError for a joint that the trace does not have, and for a trace without samples; MissingExtraError.
        """
        from daq.contracts.figure import figure_of

        require_extra("robot", "plot()", "matplotlib")
        if len(self) == 0:
            raise TraceError(f"{self.called}: has no samples to plot")
        return figure_of(self, joints, ax)

    def to_pandas(self) -> pd.DataFrame:
        """A table with one row a sample, indexed by time (s); units in `attrs`. Raises MissingExtraError."""
        return tables.to_pandas(self)

    def to_xarray(self) -> xr.Dataset:
        """Arrays over time and joint, with units and circumstances as attributes. Raises MissingExtraError."""
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
        """What messages call the trace: its file where that is known, else its number."""
        return self.file or f"trace {self.record.trace_id}"

    @property
    def missing(self) -> int:
        """Number of samples that are not there between the first and the last."""
        return sum(lost for _, lost in self.gaps)

    @property
    def drive_unit(self) -> str:
        """Unit of the drive, for people: old recordings state none, and are in volts."""
        return self.record.drive_unit or ("V" if self.record.source != "imported" else "unit not stated")

    @property
    def has_ticks(self) -> bool:
        """Whether its control periods are counted, so that missing samples show."""
        return self.tick is not None

    @property
    def missing_text(self) -> str:
        """Whether samples are missing, for people; without ticks what the times between samples show."""
        if self.tick is not None or len(self) < 2:
            return f"{self.missing} missing"
        steps = np.diff(self.time)
        usual, longest = float(np.median(steps)), int(steps.argmax())
        line = f"usually {usual:.4g} s apart, at most {steps[longest]:.4g} s (after {self.time[longest]:.4g} s)"
        return f"{line}; it has no ticks, so whether some are missing is not known"

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """Row before each gap, and how many samples are missing in it (`SampleCount`)."""
        if self.tick is None or len(self) == 0:
            return []
        steps, every = np.diff(self.tick.astype(np.int64)), self.record.every
        if every == 1:  # no sample is late without that another is missing; records may have millions of them
            rows = np.flatnonzero(steps > 1)
            return [(int(row), int(steps[row]) - 1) for row in rows]
        count = SampleCount(every)
        return [(row, lost) for row, step in enumerate(steps.tolist()) if (lost := count.missing(step))]

    def column(self, joint: int) -> int:
        """Column of joint `joint` (from 1). Raises TraceError when the trace has none."""
        if joint not in self.joints:
            raise TraceError(f"{self.called}: joint {joint} is not in it; it has {self.joints}")
        return self.joints.index(joint)


Traces = Trace | Sequence[Trace]
"""One trace, or several."""


def several(traces: Traces) -> Sequence[Trace]:
    """The traces, where one stands for a list of one. Raises SpecError for what is no trace."""
    found = (traces,) if isinstance(traces, Trace) else traces
    if wrong := [one for one in found if not isinstance(one, Trace)]:
        raise SpecError(f"traces: give a Trace or several, not {type(wrong[0]).__name__}; `read_trace` reads a file")
    return found
