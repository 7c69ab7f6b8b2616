"""Sensitivity curves as a page and as a picture: how the expected deviation of each parameter changes each reading."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from model.analysis.sensitivity import SensitivityCurve, SensitivityCurves
from model.blocks import Cell, Picture, Report, Section, Table, cells, numbers
from model.reports.figures import COLOURS, baseline, drawn, panels, saved, thinned
from model.units import joint_unit, shown_unit, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daq.contracts.machine import Machine

SHOWN = len(COLOURS)
"""Number of curves that are drawn for a joint: those of the parameters that change it most."""
PANEL_HEIGHT = 1.9
"""Height of a panel, inches."""


def sensitivity_report(label: str, found: SensitivityCurves, machine: Machine) -> Report:
    """Returns the page; `machine` is the model's and gives the units of its joints."""
    strongest = found.curves[0]
    joint = found.joints[strongest.moves_most]
    answer = (
        f"{strongest.name} changes the readings most: a change by {strongest.expected:.3g} {strongest.unit} moves "
        f"joint {joint} by up to {largest_change(found, strongest, strongest.moves_most, machine)}."
    )
    facts = (("model", f"{label}, {found.model}"), ("trace", found.trace), ("parameters", str(len(found.curves))))
    caption = (
        "Change of each joint's reading when one parameter changes by its expected deviation, the others held. For "
        f"each joint, the {SHOWN} parameters that change it most."
    )
    picture = Picture(drawn(lambda figure: _draw(figure, found, machine), PANEL_HEIGHT * len(found.joints)), caption)
    sections = (Section("How much, and when", (changes_table(found, machine),)), Section("Curves", (picture,)))
    errors = "Changes are exact to first order; each parameter changes alone."
    return Report(f"Sensitivity of {label}", answer, facts, sections, errors)


def largest_change(found: SensitivityCurves, curve: SensitivityCurve, k: int, machine: Machine) -> str:
    """Returns the largest change of the k-th joint's reading and its time, in words: 0.124° at 0.84 s."""
    place = curve.peaks[k]
    factor, unit = shown_unit(joint_unit(machine, found.joints[k]))
    return f"{with_unit(f'{factor * curve.by_joint[k][place]:+.3g}', unit)} at {found.time[place]:.2f} s"


def save_curves(found: SensitivityCurves, machine: Machine, path: Path, kind: str) -> None:
    """Saves the curves as a picture of that kind (png, svg, pdf), one panel per joint. Raises OSError."""
    saved(lambda figure: _draw(figure, found, machine), PANEL_HEIGHT * len(found.joints), path, kind)


def changes_table(found: SensitivityCurves, machine: Machine) -> Table:
    """Returns how much each parameter changes each joint's reading, and when."""
    rows = []
    for curve in found.curves:
        changes = (largest_change(found, curve, k, machine) for k in range(len(found.joints)))
        rows.append((*cells(curve.name, f"{curve.expected:.3g}"), Cell(curve.unit), *numbers(*changes)))
    head = ("parameter", "changes by", "unit", *(f"joint {joint}" for joint in found.joints))
    caption = "Largest change of each joint's reading along the trace; the strongest parameter first."
    return Table(head, tuple(rows), caption)


def _draw(figure: Figure, found: SensitivityCurves, machine: Machine) -> None:
    axes = panels(figure, len(found.joints), 1, sharex=True)
    for k, joint in enumerate(found.joints):
        factor, unit = shown_unit(joint_unit(machine, joint))
        one = axes[k][0]
        baseline(one)
        by_size = sorted(found.curves, key=lambda c: -abs(c.by_joint[k][c.peaks[k]]))
        for colour, curve in zip(COLOURS, by_size, strict=False):
            time, values = thinned(np.array(found.time), factor * np.array(curve.by_joint[k]))
            one.plot(time, values, color=colour, label=curve.name)
        one.set_ylabel(f"joint {joint} / {unit}")
        one.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes[-1][0].set_xlabel("time / s")
