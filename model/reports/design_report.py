"""The report of designed or judged experiments: the planned motions, and how much narrower intervals become."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import NoController
from model.arrays import Floats
from model.blocks import Cell, Picture, Points, Report, Section, Table, Text, cells
from model.design.information import InformationGain, ParameterGain
from model.machine_model.model import Model
from model.reports.figures import COLOURS, QUIET, drawn, panels, thinned
from model.reports.page import effect_list, listed
from model.units import joint_unit, shown_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LITTLE = 0.9
"""Share of a width above which an interval counts as not narrower."""


@dataclass(frozen=True)
class PlannedExperiment:
    """An experiment with its set points (k, joints of the machine), rad or m, one row per control period.

    nats: information of this experiment and those before it; None if they have no order.
    """

    spec: ExperimentSpec
    set_points: Floats
    nats: float | None = None


def design_report(model: Model, planned: Sequence[PlannedExperiment], gain: InformationGain, how: str) -> Report:
    """Returns the page. `how` is a sentence on how the experiments were chosen."""
    machine = model.machine
    sections = (
        Section("What becomes known", (gain_table(gain), *_gain_picture(gain), *_left_open(gain))),
        Section("The experiments", tuple(b for p in planned for b in _experiment(p, model))),
        Section("How it was done", (Text(how), Text(LIMITS_OF_IT))),
    )
    facts = (
        ("machine", machine.title),
        ("model", model.identity),
        ("effects", effect_list([use.name for use in model.effects])),
        ("experiments", listed([p.spec.name or p.spec.trajectory.kind for p in planned])),
    )
    return Report(f"Experiments for {machine.title}", _answer(planned, gain), facts, sections)


LIMITS_OF_IT = (
    "Widths are predicted from simulated records with the noise of the sensor alone, by this model. A real residual is "
    "quieter at low frequencies and louder near the loop's bandwidth, so a width is right within a factor of two or so."
)


def _answer(planned: Sequence[PlannedExperiment], gain: InformationGain) -> str:
    narrower = sum(p.share <= 0.5 for p in gain.parameters)
    count = "One experiment" if len(planned) == 1 else f"{len(planned)} experiments"
    return (
        f"{count} would at least halve the interval of {narrower} of {len(gain.parameters)} parameters; "
        f"{gain.nats:.1f} nats of information more."
    )


def gain_table(gain: InformationGain) -> Table:
    """Returns a table of the width of each interval, before and after."""
    rows = []
    for p in gain.parameters:
        left = Cell(f"{100 * p.share:.0f} %", "good" if p.share <= 0.5 else "plain", number=True)
        rows.append((*cells(p.name, f"{p.before:.3g}", f"{p.after:.3g}"), Cell(p.unit), left))
    head = ("parameter", "95 % width before", "after", "unit", "left")
    caption = "Width of the 95 % interval, from its lower to its upper end, without and with these experiments."
    return Table(head, tuple(rows), caption)


def _gain_picture(gain: InformationGain) -> tuple[Picture, ...]:
    shown = gain.parameters

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        for row, p in enumerate(reversed(shown)):
            axes.plot([p.share, 1.0], [row, row], color=QUIET, lw=1.0)
            axes.plot([p.share], [row], "o", color=COLOURS[0], ms=4.5)
        axes.axvline(1.0, color=QUIET, lw=0.8)
        axes.set_xscale("log")
        axes.set_yticks(range(len(shown)), [p.name for p in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.set_xlabel("width after / width before")
        axes.grid(visible=False, axis="y")

    return (Picture(drawn(draw, 0.6 + 0.19 * len(shown)), "Remaining width of each interval; 1 before."),)


def _left_open(gain: InformationGain) -> tuple[Text | Points, ...]:
    def told(p: ParameterGain) -> str:
        return f"{p.name}: {100 * p.share:.3g} % of its width remains"

    little = [p for p in gain.parameters if p.share >= LITTLE]
    if not little:
        return ()
    return (Text("These experiments contain little information on:", "warning"), Points(tuple(told(p) for p in little)))


def _experiment(one: PlannedExperiment, model: Model) -> tuple[Text | Picture, ...]:
    spec, machine = one.spec, model.machine
    period = 1.0 if isinstance(machine.controller, NoController) else machine.controller.period.value
    name = spec.name or spec.trajectory.kind
    words = [f"{name}: {spec.trajectory.kind.replace('_', ' ')}, {period * (len(one.set_points) - 1):.1f} s"]
    if spec.gains:
        words.append("gains " + ", ".join(f"joint {j}: {p}/{i}/{d}" for j, (p, i, d) in sorted(spec.gains.items())))
    if one.nats is not None:
        words.append(f"with those before it {one.nats:.1f} nats")

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        units = set()
        for joint in machine.modelled_joints:
            factor, unit = shown_unit(joint_unit(machine, joint))
            units.add(unit)
            signal = one.set_points[:, joint - 1] * factor
            time, wanted = thinned(np.asarray(period * np.arange(len(signal)), dtype=np.float64), signal)
            axes.plot(time, wanted, color=COLOURS[(joint - 1) % len(COLOURS)], label=f"joint {joint}, {unit}")
        axes.set_xlabel("time / s")
        axes.set_ylabel(f"set point / {' or '.join(sorted(units))}")
        axes.legend(ncols=3)
        axes.margins(x=0.01)

    return Text("; ".join(words) + "."), Picture(drawn(draw, 2.2), f"Set points of {name}.")
