"""Traces of the catalogue."""

from __future__ import annotations

from typing import Annotated

from pydantic import AwareDatetime, Field

from daq.contracts.frozen import FrozenRecord
from daq.contracts.labels import Outcome, Source, Tag
from daq.contracts.service.base import Wire
from daq.contracts.trace import TraceEvent, TraceRecord


class CatalogueEntry(Wire):
    """One trace as the catalogue lists it."""

    id: str
    robot: str
    file: str
    created: AwareDatetime
    source: Source
    kind: str | None
    """Kind of trajectory, if the trace is of an experiment."""
    name: str | None
    joints: tuple[int, ...]
    moved: tuple[int, ...] = ()
    """Joints that the whole experiment moves; of other traces, those that moved."""
    outcome: Outcome | None
    samples: int | None
    duration: float | None
    """Time (s) between the first and the last sample."""
    size: int
    """Size of the file (bytes)."""
    operator: str | None
    experiment: str | None
    """The queued experiment that made it."""
    tags: tuple[str, ...] = ()
    notes: str = ""
    missing: bool = False
    """Whether its file is gone from the folder."""


class JointFigureSet(FrozenRecord):
    """Figures of one joint: angles in degrees (`unit` °), lengths in mm on a prismatic joint; times in s, drive in the
    trace's unit.

    `overshoot`: how far the joint went beyond the last set point, in the direction of the motion. `rise_time`: time of
    the position from 10 to 90 % of the change of the set point. Both are None unless it changes one way in one go.
    """

    joint: int
    unit: str
    moved: bool
    start: float
    end: float
    overshoot: float | None
    rise_time: float | None
    largest_error: float | None
    final_error: float | None
    largest_drive: float | None


class TraceDetails(Wire):
    """One trace: its record, figures and events."""

    entry: CatalogueEntry
    record: TraceRecord
    figures: tuple[JointFigureSet, ...]
    events: tuple[TraceEvent, ...]
    missing_samples: int


class TraceChange(Wire):
    """New tags or notes; fields that are None stay unchanged."""

    tags: Annotated[tuple[Tag, ...], Field(max_length=50)] | None = None
    notes: Annotated[str, Field(max_length=10000)] | None = None


class TraceSignals(Wire):
    """Signals of a trace for a plot, thinned to the extremes of short intervals, so that no peak is lost.

    `time` is in s. A signal has one row per joint, in the order of `joints`, in rad (m for a prismatic joint); the
    drive is in `drive_unit`. A signal that was not recorded is None.
    """

    id: str
    joints: tuple[int, ...]
    samples: int
    """Number of samples before thinning."""
    time: tuple[float, ...]
    position: tuple[tuple[float, ...], ...]
    set_point: tuple[tuple[float, ...], ...] | None = None
    error: tuple[tuple[float, ...], ...] | None = None
    drive: tuple[tuple[float, ...], ...] | None = None
    drive_unit: str | None = None
    events: tuple[TraceEvent, ...] = ()
