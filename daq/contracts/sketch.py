"""What a notebook shows of a trace: facts and a small picture, in HTML without scripts."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from daq.contracts.recorded import Recorded

WIDTH, HEIGHT, MARGIN = 420, 110, 6
MOST_POINTS = 300
"""Points of a line: more would not show in the picture's width."""
JOINT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#A07800", "#4B4B9B")
"""Colours of the joints: those of Okabe and Ito, which colour-blind readers can distinguish; yellow darkened for
paper."""


def html_of(trace: Recorded) -> str:
    """One line of facts and the positions over time, each joint within its own range. Every text is escaped."""
    record = trace.record
    name = record.spec.name if record.spec is not None and record.spec.name else record.robot
    span = f"{trace.time[-1] - trace.time[0]:.1f} s" if len(trace) else "0 s"
    facts = f"{len(trace)} samples in {span}, {trace.missing} missing, {record.outcome or 'no outcome'}"
    head = f"<b>{escape(name)}</b> <code>{escape(record.trace_id)}</code> · {escape(facts)}"
    return f"<div>{head}<br>{_picture(trace)}</div>"


def _picture(trace: Recorded) -> str:
    lines, labels = [], []
    for column, joint in enumerate(trace.joints):
        colour = JOINT_COLOURS[(joint - 1) % len(JOINT_COLOURS)]
        if len(trace):
            points = _points(trace.time, trace.position[:, column])
            lines.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1.5" points="{points}"/>')
        labels.append(f'<tspan fill="{colour}">joint {int(joint)}  </tspan>')
    title = f"Positions of joints {', '.join(map(str, trace.joints))} over time, each within its own range"
    text = f'<text x="{MARGIN}" y="{HEIGHT + 14}" font-size="12" font-family="sans-serif">{"".join(labels)}</text>'
    size = f'width="{WIDTH}" height="{HEIGHT + 20}" viewBox="0 0 {WIDTH} {HEIGHT + 20}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" {size}><title>{title}</title>{"".join(lines)}{text}</svg>'
    )


def _points(time: NDArray[np.float64], values: NDArray[np.float64]) -> str:
    rows = np.unique(np.linspace(0, len(time) - 1, MOST_POINTS).round().astype(int))
    x = _scaled(time[rows], WIDTH)
    y = HEIGHT - _scaled(values[rows], HEIGHT)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _scaled(values: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Values over the size, within its margins; equal ones in the middle."""
    low, span = values.min(), float(np.ptp(values))
    share = (values - low) / span if span > 0 else np.full(len(values), 0.5)
    scaled: NDArray[np.float64] = MARGIN + share * (size - 2 * MARGIN)
    return scaled
