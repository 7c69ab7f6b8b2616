"""Profile likelihoods as a page and as a picture: how much worse the best fit becomes when one parameter is moved."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from model.blocks import Cell, Picture, Report, Section, Table, Text, cells
from model.fitting.profile import Profile
from model.fitting.result import FitResult
from model.reports.figures import COLOURS, QUIET, drawn, panels, saved
from model.reports.page import listed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL_HEIGHT = 2.1
"""Height of a panel, inches."""
HIGHEST = 2.5
"""Top of a panel, in units of the rise that ends the interval."""


def profile_report(fitted: FitResult, profiles: Sequence[Profile]) -> Report:
    """Returns the page of some parameters' profiles about a fit."""
    picture = Picture(
        drawn(lambda figure: _draw(figure, fitted, profiles), PANEL_HEIGHT * len(profiles)),
        "Rise of −2 ln L when the parameter is fixed elsewhere and all others are refitted. The line is the rise at "
        "which the 95 % interval ends; the band is the interval. Dashed: the parabola of the fit's covariance.",
    )
    blocks: list[Table | Text] = [bounds_table(profiles)]
    if better := [one.name for one in profiles if one.better]:
        blocks.append(Text(better_fit(better), "warning"))
    facts = (
        ("machine", fitted.model.machine.title),
        ("model", fitted.model.identity),
        ("fitted to", f"{listed(fitted.traces)}: {fitted.samples} samples"),
        ("searches", str(fitted.options.starts)),
    )
    sections = (Section("Intervals", tuple(blocks)), Section("Profiles", (picture,)))
    answer = " ".join(f"{one.name}: {bounded(one)}." for one in profiles)
    errors = "The parameter's own prior is left out; those of all others are used."
    return Report(f"Profile likelihoods of {fitted.model.machine.title}", answer, facts, sections, errors)


def bounded(one: Profile) -> str:
    """Returns the bounds that the data give, in words."""
    low, high = (None if end is None else f"{end:.4g}" for end in (one.low, one.high))
    if low is not None and high is not None:
        return f"{low} to {high} {one.unit}"
    if low is None and high is None:
        return "bounded on neither side by these traces"
    return f"bounded on one side alone: {f'at least {low}' if high is None else f'at most {high}'} {one.unit}"


def better_fit(names: Sequence[str]) -> str:
    """Returns the line about profiles that found a better fit than the fit itself."""
    return (
        f"{listed(names)}: another value fits better than the fit's own, which had ended in a local minimum. "
        "Search from more starting values (--starts)."
    )


def save_profiles(fitted: FitResult, profiles: Sequence[Profile], path: Path, kind: str) -> None:
    """Saves the profiles as a picture of that kind (png, svg, pdf), one panel per parameter. Raises OSError."""
    saved(lambda figure: _draw(figure, fitted, profiles), PANEL_HEIGHT * len(profiles), path, kind)


def bounds_table(profiles: Sequence[Profile]) -> Table:
    """Returns the best value of each parameter, and its bounds from the data."""
    rows = tuple(
        (*cells(one.name, f"{one.value:.5g}"), *(_end(end) for end in (one.low, one.high)), Cell(one.unit))
        for one in profiles
    )
    caption = "95 % intervals. A side without a number is not bounded by these traces, as far as the profile reaches."
    return Table(("parameter", "best", "at least", "at most", "unit"), rows, caption)


def _end(end: float | None) -> Cell:
    return Cell("–", "warning", number=True) if end is None else Cell(f"{end:.4g}", number=True)


def _draw(figure: Figure, fitted: FitResult, profiles: Sequence[Profile]) -> None:
    for row, (axes,) in enumerate(panels(figure, len(profiles), 1)):
        one = profiles[row]
        ends = (one.values[0] if one.low is None else one.low, one.values[-1] if one.high is None else one.high)
        axes.axvspan(*ends, color=QUIET, alpha=0.16, lw=0)
        axes.axhline(one.rise, color=QUIET, lw=0.8)
        axes.plot(one.values, one.rises, "o-", color=COLOURS[row % len(COLOURS)], ms=3)
        index = fitted.names.index(one.name)
        variance = fitted.covariance_matrix[index, index]
        step = (one.values[-1] - one.values[0]) / 100
        line = [one.values[0] + k * step for k in range(101)]
        factor = one.rise / 3.841459
        axes.plot(line, [factor * (v - one.value) ** 2 / variance for v in line], "--", color=QUIET, lw=0.8)
        axes.set_ylim(min(0.0, *one.rises) - 0.05 * one.rise, HIGHEST * one.rise)
        axes.set_xlabel(f"{one.name} / {one.unit}")
        axes.set_ylabel("rise of −2 ln L")
