"""The report of a validation by distortion: the sum, its curves, and the variations over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from model.blocks import Cell, Picture, Points, Report, Section, Table, Text, Tone, cells, numbers
from model.reports.figures import COLOURS, INK, QUIET, baseline, drawn, panels, thinned
from model.reports.page import listed, record_sections
from model.units import joint_unit, squared
from model.validation.criterion import Curve, Fidelity
from model.validation.variation import TimeDomain, Variation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from daq.contracts.machine import Machine

CURVES_ABREAST = 4
VARIATIONS_SHOWN = 8
"""Number of variations over time that are drawn: those that explain most of the residual."""


def validation_report(
    label: str, found: tuple[Fidelity, Fidelity], in_time: Sequence[TimeDomain], machine: Machine
) -> Report:
    """Returns the page of a validation; `found` is in the source's convention of τ′ and in that of three standard
    deviations.

    machine: the model's machine, which gives the units of its joints.
    """
    source, three = found
    sections = [
        Section(
            "How far parameters would have to vary",
            (distortion_table(source, three), _contribution_picture(source, three)),
        ),
        *([Section("How the error grows", (_curves(source),))] if source.curves else []),
        *(_in_time(one, machine) for one in in_time),
    ]
    if source.notes:
        sections.append(Section("Remarks", (Points(source.notes),)))
    joints = ", ".join(f"joint {j}: {e:.3g}" for j, e in zip(source.outputs, source.error_by_joint, strict=True))
    unit = squared(joint_unit(machine, joint) for joint in source.outputs)
    facts = (
        ("model", f"{label}, {source.model}"),
        ("traces", listed(source.traces)),
        ("squared error", f"{source.error:.4g} {unit} ({joints})"),
        ("Σλ²", f"{source.sum_of_contributions:.4f} with τ′ = â/(3√2), {three.sum_of_contributions:.4f} with τ′ = â/3"),
        ("damping ratio", f"{source.damping_ratio:g}, of the associate system"),
    )
    return Report(
        f"Validation of {label} by distortion",
        _answer(source),
        facts,
        (*record_sections(source.record), *sections),
    )


def _answer(source: Fidelity) -> str:
    strongest = max(source.parameters, key=lambda p: p.contribution)
    return f"{source.said} The largest contribution is that of {strongest.name}, {strongest.contribution:.2g}."


def distortion_table(source: Fidelity, three: Fidelity) -> Table:
    """Returns how far each parameter alone would have to vary, in both conventions of τ′."""
    rows = []
    for one, other in zip(source.parameters, three.parameters, strict=True):
        down = "–" if one.change_down is None else f"−{one.change_down:.3g}"
        up = "–" if one.change_up is None else f"+{one.change_up:.3g}"
        needed = "very large" if one.required is None else f"{one.required:.3g}"
        shares = (f"{c:.4f}" for c in (one.contribution, other.contribution))
        found = numbers(f"{down} / {up}", needed, f"{one.expected:.3g}", *shares)
        rows.append((*cells(one.name, f"{one.value:.5g}"), Cell(one.unit), *found))
    caption = (
        "The change of one parameter alone that doubles the mean squared error gives σ, the standard deviation it "
        "would need to explain the residual (4.63); λ² = τ′²/σ² (4.92) compares it with the expected one."
    )
    head = ("parameter", "value", "unit", "doubles the error at", "σ needed", "τ′ expected", "λ²", "λ² with â/3")
    return Table(head, tuple(rows), caption)


def _contribution_picture(source: Fidelity, three: Fidelity) -> Picture:
    shown = sorted(source.parameters, key=lambda p: p.contribution)[-14:]
    other = {p.name: p.contribution for p in three.parameters}

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        rows = np.arange(len(shown))
        axes.barh(
            rows + 0.2, [p.contribution for p in shown], 0.36, color=COLOURS[0], label="τ′ = â/(3√2), the source's"
        )
        axes.barh(rows - 0.2, [other[p.name] for p in shown], 0.36, color=COLOURS[1], label="τ′ = â/3")
        axes.set_yticks(rows, [p.name for p in shown])
        axes.axvline(1.0, color=QUIET, lw=0.9, ls=(0, (4, 2)))
        axes.set_xscale("log")
        axes.set_xlim(1e-4, 2.0 * max(1.0, *other.values()))
        axes.set_xlabel("contribution λ²")
        axes.grid(visible=False, axis="y")
        figure.legend(loc="outside upper right", ncols=2)

    caption = (
        "Contributions to Σλ², the largest above. The model explains the record when their sum reaches 1 (dashed)."
    )
    return Picture(drawn(draw, 0.8 + 0.26 * len(shown)), caption)


def _curves(found: Fidelity) -> Picture:
    rows = -(-len(found.curves) // CURVES_ABREAST)

    def draw(figure: Figure) -> None:
        axes = panels(figure, rows, CURVES_ABREAST, sharey=True)
        for place, curve in enumerate(found.curves):
            _curve(axes.flat[place], curve, found)
            if place % CURVES_ABREAST == 0:
                axes.flat[place].set_ylabel("error / least")
        for empty in axes.flat[len(found.curves) :]:
            empty.set_visible(False)

    caption = (
        "Mean squared error over its least against each parameter, the others held. The dashed line is twice the "
        "least; a flat curve is a parameter that does not influence the record."
    )
    return Picture(drawn(draw, 1.45 * rows + 0.2), caption)


def _curve(axes: Axes, curve: Curve, found: Fidelity) -> None:
    one = {p.name: p for p in found.parameters}[curve.name]
    errors = np.array([np.nan if e is None else e for e in curve.errors]) / found.error
    axes.plot(curve.values, errors, color=COLOURS[0])
    axes.axhline(2.0, color=QUIET, lw=0.8, ls=(0, (4, 2)))
    axes.axvline(one.value, color=QUIET, lw=0.7)
    axes.axvspan(one.value - one.expected, one.value + one.expected, color=QUIET, alpha=0.16, lw=0)
    axes.set_ylim(0.0, 4.0)
    axes.set_title(_short(curve.name), fontsize=6.6)
    axes.tick_params(labelsize=6.5)
    axes.locator_params(axis="x", nbins=3)


def _short(name: str) -> str:
    """Splits a long name into two lines."""
    head, _, tail = name.partition(".")
    return name if len(name) < 22 else f"{head}.\n{tail}"


def _in_time(one: TimeDomain, machine: Machine) -> Section:
    shown = sorted(one.parameters, key=lambda v: -v.alone_varying)[:VARIATIONS_SHOWN]
    blocks: list[Text | Table | Picture | Points] = [
        Text(
            "All parameters vary together, as little as explains the measured accelerations. A variation beyond its "
            "noise shows which term is wrong, when, and what it depends on."
        ),
        variation_table(one),
        _residual_picture(one, machine),
        _variation_picture(one, shown),
    ]
    if one.notes:
        blocks.append(Points(one.notes))
    return Section(f"Variation with time: {one.trace}", tuple(blocks))


def variation_table(one: TimeDomain) -> Table:
    """Returns how far each parameter would have to vary over time, and with what."""
    rows = []
    for v in one.parameters:
        strongest = [f"{c.regressor} of joint {c.joint} ({c.value:+.2f})" for c in v.against if c.significant][:2]
        tone: Tone = "plain" if v.within_expectation else "warning"
        sizes = (*numbers(f"{v.deviation:.3g}", tone=tone), *numbers(f"{v.expected:.3g}"))
        shares = numbers(*(f"{100 * s:.0f} %" for s in (v.significant, v.alone_constant, v.alone_varying)))
        rows.append((Cell(v.name), *sizes, Cell(v.unit), *shares, Cell(", ".join(strongest) or "–")))
    return Table(
        ("parameter", "σ of α(t)", "τ′", "unit", "beyond noise", "explains, constant", "varying", "goes with"),
        tuple(rows),
        "σ of the variation against the expected one (4.24). Beyond noise: share of the time at which it is. Explains: "
        "share of the residual's energy that this parameter explains alone, as a constant and varying.",
    )


def _residual_picture(one: TimeDomain, machine: Machine) -> Picture:
    units = [f"{joint_unit(machine, j.joint)}/s²" for j in one.joints]
    alike = len(set(units)) == 1

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(one.joints), sharey=alike)[0]
        for place, joint in enumerate(one.joints):
            time, values = thinned(np.array(one.time), _numbers(joint.values))
            axes[place].axhspan(-2 * joint.noise, 2 * joint.noise, color=QUIET, alpha=0.16, lw=0)
            baseline(axes[place])
            axes[place].plot(time, values, color=COLOURS[(joint.joint - 1) % len(COLOURS)], lw=0.9)
            axes[place].set_title(f"joint {joint.joint}")
            axes[place].set_xlabel("time / s")
            if place == 0 or not alike:
                axes[place].set_ylabel(f"measured − expected / {units[place]}")

    told = [
        f"joint {j.joint}: {', '.join(f'{c.regressor} of joint {c.joint} ({c.value:+.2f})' for c in strong)}"
        for j in one.joints
        if (strong := [c for c in j.against if c.significant][:3])
    ]
    floors = "; ".join(f"joint {j.joint}: rms {j.rms:.3g}, {j.in_floors:.2g} × the noise floor" for j in one.joints)
    tail = f" It goes with: {'; '.join(told)}." if told else ""
    caption = f"Acceleration that the model does not expect; the band is twice its noise floor. {floors}.{tail}"
    return Picture(drawn(draw, 1.9), caption)


def _variation_picture(one: TimeDomain, shown: Sequence[Variation]) -> Picture:
    columns = 2
    rows = -(-len(shown) // columns)

    def draw(figure: Figure) -> None:
        axes = panels(figure, rows, columns, sharex=True)
        for place, v in enumerate(shown):
            _variation(axes.flat[place], np.array(one.time), v)
        for empty in axes.flat[len(shown) :]:
            empty.set_visible(False)
        for last in axes[-1]:
            last.set_xlabel("time / s")

    caption = (
        f"α(t) of the {len(shown)} parameters that explain most, with twice its noise (shaded) and ±τ′ (dashed). "
        "The line is interrupted while no joint moves that depends on the parameter."
    )
    return Picture(drawn(draw, 1.35 * rows + 0.3), caption)


def _variation(axes: Axes, time: np.ndarray, v: Variation) -> None:
    time, values, noise = thinned(time, _numbers(v.values), _numbers(v.noise))
    axes.fill_between(time, values - 2 * noise, values + 2 * noise, color=QUIET, alpha=0.25, lw=0)
    baseline(axes)
    axes.plot(time, values, color=COLOURS[0], lw=0.9)
    for side in (-1, 1):
        axes.axhline(side * v.expected, color=INK, lw=0.6, ls=(0, (4, 3)))
    axes.set_title(f"{v.name} / {v.unit}", fontsize=7)
    reach = 1.15 * max(v.expected, float(np.nanmax(np.abs(values), initial=0.0)))
    axes.set_ylim(-reach, reach)


def _numbers(values: Sequence[float | None]) -> np.ndarray:
    return np.array([np.nan if v is None else v for v in values])
