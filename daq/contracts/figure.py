"""Plots a trace: position and set point, error, drive.

matplotlib is imported only when a figure is made.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from daq.contracts.sketch import JOINT_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from daq.contracts.recorded import Floats, Recorded, RecordedEvent

INK = "#222222"
QUIET = "#8a8a8a"
SET_POINT = "#555555"
ALARM = "#B00020"
GAP = "#f3d9a4"
JOINTS_ABREAST = 3
"""Joints side by side. Further joints get another band of panels, so that the figure fits a page."""

_ALARMS: frozenset[str] = frozenset({"limit", "restart", "link_lost", "stop", "fault"})
_UNMARKED: frozenset[str] = frozenset(
    {"start", "end", "note", "waypoint", "gains", "retry", "missing", "missed_set_point"}
)
"""Kinds of event that are not marked: there may be hundreds of them, or the axes already show them."""
_MOTIONS: frozenset[str] = frozenset({"ramp_start", "ramp_end"})
"""The ends of a motion, whose messages name the motion: "sine ends"."""

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": QUIET,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "svg.hashsalt": "ma2000-daq",
}
"""Style for print."""


@dataclass(frozen=True)
class _Row:
    """One row of panels: its signal and unit."""

    title: str
    unit: str
    measured: Floats
    wanted: Floats | None = None


def figure_of(trace: Recorded, joints: tuple[int, ...] | None = None, axes: Axes | None = None) -> Figure:
    """Returns the figure: one row per signal, one column per joint, marks at events; or positions on given axes."""
    if axes is not None:
        from daq.contracts.notebook_figure import axes_of

        axes = axes_of(axes)
        shown = _only(trace, joints)
        row = _rows(shown)[0]
        for column, joint in enumerate(shown.joints):
            (line,) = axes.plot(shown.time, row.measured[:, column], label=f"joint {joint}")
            if row.wanted is not None:
                axes.plot(shown.time, row.wanted[:, column], "--", color=line.get_color(), lw=0.8)
        axes.set(xlabel="time / s", ylabel=f"{row.title} / {row.unit}")
        axes.legend()
        return cast("Figure", axes.figure)
    import matplotlib as mpl

    from daq.contracts.notebook_figure import AS_WRITTEN

    with mpl.rc_context(AS_WRITTEN):
        return _figure(trace, joints)


def _figure(trace: Recorded, joints: tuple[int, ...] | None) -> Figure:
    from daq.contracts.notebook_figure import NotebookFigure

    recorded = trace.joints
    trace = _only(trace, joints)
    rows = _rows(trace)
    columns = min(len(trace.joints), JOINTS_ABREAST)
    bands = math.ceil(len(trace.joints) / columns)
    figure = NotebookFigure(figsize=(max(6.3, 3.1 * columns + 0.6), bands * (1.9 * len(rows) + 0.6) + 0.8))
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.05, hspace=0.03)
    axes = figure.subplots(len(rows) * bands, columns, sharex=True, squeeze=False)
    for column, joint in enumerate(trace.joints):
        band, place = divmod(column, columns)
        panels = axes[band * len(rows) : (band + 1) * len(rows), place]
        _head(panels[0], trace, joint, column)
        for panel, row in zip(panels, rows, strict=True):
            _draw(panel, trace, row, column)
            if place == 0:
                panel.set_ylabel(f"{row.title} / {row.unit}")
        panels[-1].set_xlabel("time / s")
        panels[-1].tick_params(labelbottom=True)
    for empty in axes[-len(rows) :, len(trace.joints) - (bands - 1) * columns :].flat:
        empty.set_visible(False)
    _legend(axes[0][0], trace)
    figure.align_ylabels()
    # XML allows no other characters
    shown = "".join(s if s.isprintable() else "\N{REPLACEMENT CHARACTER}" for s in title_of(trace))
    figure.suptitle(shown, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK)
    figure.supxlabel(_foot(trace, recorded), x=0.01, ha="left", fontsize=7.5, color=QUIET)
    return figure


def _only(trace: Recorded, joints: tuple[int, ...] | None) -> Recorded:
    """Returns the trace with only the joints to draw."""
    if joints is None:
        moved = trace.record.spec.joints if trace.record.spec else trace.joints
        joints = tuple(joint for joint in trace.joints if joint in moved) or trace.joints
    columns = [trace.column(joint) for joint in joints]
    names = ("position", "set_point", "error", "drive", "velocity", "power_raw")
    signals = {name: getattr(trace, name)[:, columns] for name in names if getattr(trace, name) is not None}
    return replace(cast("Any", trace), joints=joints, **signals)  # type: ignore[no-any-return]


def _rows(trace: Recorded) -> list[_Row]:
    metres = _prismatic(trace)
    scale, unit = (1000.0, "mm") if metres else (math.degrees(1.0), "°")
    wanted = None if trace.set_point is None else trace.set_point * scale
    rows = [_Row("position", unit, trace.position * scale, wanted)]
    if trace.error is not None:
        rows.append(_Row("error", unit, trace.error * scale))
    if trace.drive is not None:
        rows.append(_Row("drive", trace.drive_unit, trace.drive))
    if trace.velocity is not None:
        rows.append(_Row("velocity", f"{unit}/s", trace.velocity * scale))
    return rows


def _prismatic(trace: Recorded) -> bool:
    """Whether all joints of the trace are prismatic; for mixed kinds, the machine gives the unit."""
    machine = trace.record.machine
    if machine is None or max(trace.joints) > len(machine.joints):
        return False
    return all(machine.joint(joint).kind == "prismatic" for joint in trace.joints)


def _draw(axes: Axes, trace: Recorded, row: _Row, column: int) -> None:
    for before, after in _gaps(trace):
        axes.axvspan(before, after, color=GAP, lw=0, zorder=0)
    for event in trace.events:
        if event.kind not in _UNMARKED and event.joint in (None, trace.joints[column]):
            alarm = event.kind in _ALARMS
            axes.axvline(event.time, color=ALARM if alarm else QUIET, lw=0.8, ls="-" if alarm else ":", zorder=1)
    if row.wanted is None:
        axes.axhline(0.0, color=QUIET, lw=0.7, zorder=1)
    else:
        time, wanted = _broken_at_gaps(trace, row.wanted[:, column])
        axes.plot(time, wanted, color=SET_POINT, lw=1.0, ls=(0, (4, 2)), drawstyle="steps-post", label="set point")
    time, measured = _broken_at_gaps(trace, row.measured[:, column])
    colour = JOINT_COLOURS[(trace.joints[column] - 1) % len(JOINT_COLOURS)]
    axes.plot(time, measured, color=colour, lw=1.3, label=row.title, solid_joinstyle="round")
    axes.margins(x=0.01)
    axes.set_ylim(*_limits(row, column))
    axes.tick_params(length=2.5)


def _limits(row: _Row, column: int) -> tuple[float, float]:
    """Axis limits with the same span for every joint, so that joints can be compared; positions are centred per
    joint."""
    both = [row.measured] if row.wanted is None else [row.measured, row.wanted]
    low, high = np.min([s.min(axis=0) for s in both], axis=0), np.max([s.max(axis=0) for s in both], axis=0)
    if row.title != "position":
        low, high = np.full_like(low, min(low.min(), 0.0)), np.full_like(high, max(high.max(), 0.0))
    half = max(float((high - low).max()) * 0.56, 1e-6)
    middle = float(low[column] + high[column]) / 2
    return middle - half, middle + half


def _legend(axes: Axes, trace: Recorded) -> None:
    from matplotlib.patches import Patch

    handles, _ = axes.get_legend_handles_labels()
    if _gaps(trace):
        handles.append(Patch(color=GAP, label="samples missing"))
    axes.legend(handles=handles, loc="best", frameon=False, handlelength=2.2, fontsize=8)


def _head(axes: Axes, trace: Recorded, joint: int, column: int) -> None:
    machine = trace.record.machine
    name = machine.joint(joint).name if machine and joint <= len(machine.joints) else ""
    gains = trace.record.gains.get(joint) if trace.record.gains else None
    title = f"joint {joint}" + (f", {name}" if name else "")
    colour = JOINT_COLOURS[(joint - 1) % len(JOINT_COLOURS)]
    axes.set_title(title, loc="left", fontsize=9.5, fontweight="bold", color=colour, pad=14)
    if gains is not None:
        axes.set_title("P {} · I {} · D {}".format(*gains), loc="right", fontsize=8, color=QUIET, pad=14)
    for event in _labelled(trace, column):
        axes.annotate(
            _mark(event),
            (event.time, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=6.5,
            color=ALARM if event.kind in _ALARMS else QUIET,
            annotation_clip=False,
        )


def _mark(event: RecordedEvent) -> str:
    if event.kind in _MOTIONS and event.message:
        return event.message
    return event.kind.replace("_", " ")


def _labelled(trace: Recorded, column: int) -> list[RecordedEvent]:
    """Marked events whose labels do not overlap earlier ones; alarms take precedence."""
    apart = (trace.time[-1] - trace.time[0]) * 0.19
    marked = [e for e in trace.events if e.kind not in _UNMARKED and e.joint in (None, trace.joints[column])]
    labelled: list[RecordedEvent] = []
    for event in sorted(marked, key=lambda event: event.kind not in _ALARMS):
        if all(abs(event.time - other.time) >= apart for other in labelled):
            labelled.append(event)
    return labelled


def _gaps(trace: Recorded) -> list[tuple[float, float]]:
    return [(float(trace.time[row]), float(trace.time[row + 1])) for row, _ in trace.gaps]


def _broken_at_gaps(trace: Recorded, signal: Floats) -> tuple[Floats, Floats]:
    """Time and signal with a NaN in every gap, so that no line is drawn through missing samples."""
    after = np.array([row + 1 for row, _ in trace.gaps], dtype=np.intp)
    return np.insert(trace.time, after, trace.time[after - 1]), np.insert(signal, after, math.nan)


def title_of(trace: Recorded) -> str:
    """Returns kind of motion, robot, source and, if it was not complete, the outcome."""
    record = trace.record
    what = (record.spec.name or record.spec.trajectory.kind) if record.spec else "trace"
    source = {"mock": "mock controller", "real": "real arm", "imported": "imported"}[record.source]
    title = f"{what}, {record.robot}, {source}"
    return title if record.outcome in ("complete", None) else f"{title}: {record.outcome}"


def _foot(trace: Recorded, recorded: tuple[int, ...]) -> str:
    record = trace.record
    created = record.created.strftime("%Y-%m-%d %H:%M:%S UTC")
    missing = f", {trace.missing} missing" if trace.has_ticks else ""
    foot = f"{created}   trace {record.trace_id}   {len(trace)} samples{missing}   {record.software}"
    held = [str(joint) for joint in recorded if joint not in trace.joints]
    return f"{foot}   recorded too: joint {', '.join(held)}" if held else foot
