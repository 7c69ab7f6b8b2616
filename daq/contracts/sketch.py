"""HTML for notebooks: facts of a trace and a small picture, without scripts."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import joint_names
from daq.contracts.recorded import Recorded
from daq.contracts.tables import is_prismatic

WIDTH, HEIGHT, MARGIN = 420, 110, 6
MOST_POINTS = 300
"""Most points of a line; more would not be visible at the picture's width."""
JOINT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#A07800", "#4B4B9B")
"""Colours of the joints by Okabe and Ito, which colour-blind readers can distinguish; yellow is darkened for paper."""


def name_of(trace: Recorded) -> str:
    """Returns the name of the trace for people: its experiment's name, else the kind of motion; without an experiment,
    the robot."""
    spec = trace.record.spec
    return str(trace.record.robot if spec is None else spec.name or spec.trajectory.kind)


def html_of(trace: Recorded) -> str:
    """Returns facts, a plot of each joint's distance from its first position over time, and its range. Every text is
    escaped."""
    record, name = trace.record, name_of(trace)
    facts = f"{len(trace)} samples, {trace.missing_text}, {record.outcome or 'no outcome'}"
    head = f"<b>{escape(name)}</b> <code>{escape(record.trace_id)}</code> · {escape(facts)}"
    return f"<div>{head}<br>{_picture(trace)}<br>{_key(trace)}</div>"


def _picture(trace: Recorded) -> str:
    """Draws lines in a frame with the first and the last time (s) below; frame and text have the page's colour."""
    title = f"How far joints {', '.join(map(str, trace.joints))} moved over time"
    found = [f"<title>{title}</title>"]
    frame = f'width="{WIDTH - 1}" height="{HEIGHT - 1}" fill="none" stroke="currentColor" stroke-opacity="0.3"'
    found.append(f'<rect x="0.5" y="0.5" {frame}/>')
    if len(trace):
        moved = _moved(trace)
        for column in np.argsort(np.ptp(moved, axis=0), kind="stable"):
            colour = _colour(trace.joints[column])
            stroke = f'stroke="{colour}" stroke-width="1.5" stroke-linejoin="round"'
            found.append(f'<polyline fill="none" {stroke} points="{_points(trace.time, moved[:, column])}"/>')
        for x, anchor, time in ((0, "start", trace.time[0]), (WIDTH, "end", trace.time[-1])):
            place = f'x="{x}" y="{HEIGHT + 14}" text-anchor="{anchor}"'
            found.append(
                f'<text {place} fill="currentColor" font-size="11" font-family="sans-serif">{time:.1f} s</text>'
            )
    size = f'width="{WIDTH}" height="{HEIGHT + 20}" viewBox="0 0 {WIDTH} {HEIGHT + 20}" style="max-width:100%"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size}>{"".join(found)}</svg>'


def _key(trace: Recorded) -> str:
    """Returns colour, number, name and range of each joint."""
    found = []
    names = joint_names(trace.record.machine, trace.joints)
    for column, (joint, name) in enumerate(zip(trace.joints, names, strict=True)):
        label = f"joint {int(joint)}" if name == f"joint_{joint}" else f"{int(joint)} {name}"
        if len(trace):
            low, high, unit = _range(trace, column)
            label += f": {low:.1f} to {high:.1f}{unit}" if f"{low:.1f}" != f"{high:.1f}" else f": {low:.1f}{unit}"
        mark = f'<span style="color:{_colour(joint)}">&#9644;</span>'
        found.append(f'<span style="white-space:nowrap;margin-right:1em">{mark} {escape(label)}</span>')
    return f"<small>{' '.join(found)}</small>"


def _range(trace: Recorded, column: int) -> tuple[float, float, str]:
    """Smallest and largest position of a joint in degrees or mm, with the unit."""
    scale, unit = (1000.0, " mm") if is_prismatic(trace, trace.joints[column]) else (180 / np.pi, "°")
    values = (trace.position[:, column] * scale).round(1) + 0.0  # turns -0.0 into 0.0
    return float(values.min()), float(values.max()), unit


def _colour(joint: int) -> str:
    return JOINT_COLOURS[(joint - 1) % len(JOINT_COLOURS)]


def _moved(trace: Recorded) -> NDArray[np.float64]:
    """Positions (n, joints) since the first sample, scaled to 0 to 1 by the widest range among joints of the same kind.
    A joint at rest is therefore a straight line, whatever its sensor noise."""
    found: NDArray[np.float64] = trace.position - trace.position[0]
    slides = np.array([is_prismatic(trace, joint) for joint in trace.joints])
    for kind in (slides, ~slides):
        if kind.any():
            low, high = found[:, kind].min(), found[:, kind].max()
            found[:, kind] = (found[:, kind] - low) / (high - low) if high > low else 0.5
    return found


def _points(time: NDArray[np.float64], shares: NDArray[np.float64]) -> str:
    rows = np.unique(np.linspace(0, len(time) - 1, MOST_POINTS).round().astype(int))
    span = float(np.ptp(time))
    along = (time[rows] - time[0]) / span if span > 0 else np.full(len(rows), 0.5)
    x = MARGIN + along * (WIDTH - 2 * MARGIN)
    y = HEIGHT - MARGIN - shares[rows] * (HEIGHT - 2 * MARGIN)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
