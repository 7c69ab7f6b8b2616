"""A measurement with its target and comparison, and the table that shows them."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One measured value. `met` is None without a target; `beside` is its floor or rival in the same run."""

    name: str
    value: str
    target: str = ""
    met: bool | None = None
    beside: str = ""


def at_most(name: str, value: float, limit: float, unit: str, beside: str = "") -> Figure:
    """Returns a measurement that must not exceed a limit."""
    return Figure(name, f"{value:.3g} {unit}", f"≤ {limit:g} {unit}", value <= limit, beside)


def none(name: str, count: int, beside: str = "") -> Figure:
    """Returns a count that must be 0."""
    return Figure(name, f"{count}", "0", count == 0, beside)


def show(title: str, command: str, figures: Sequence[Figure]) -> int:
    """Prints the measurements as a table; returns the exit code: 1 when a target was missed."""
    rows = [("figure", "measured", "target", "met", "beside")]
    rows += [(f.name, f.value, f.target, {None: "", True: "yes", False: "NO"}[f.met], f.beside) for f in figures]
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    print(f"\n{title}    [{machine()}]")
    for index, row in enumerate(rows):
        print("  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
        if index == 0:
            print("  " + "  ".join("-" * width for width in widths))
    print(f"  again: {command}", flush=True)
    return 1 if any(figure.met is False for figure in figures) else 0


def machine() -> str:
    """Describes the machine; its load shows how quiet it was."""
    cores = len(os.sched_getaffinity(0))
    return f"{cores} cores, Python {platform.python_version()}, load {os.getloadavg()[0]:.1f}"


def quantile(values: Sequence[float], share: float) -> float:
    """Returns the smallest value that at least `share` of all values do not exceed."""
    ordered = sorted(values)
    return ordered[max(0, -(-int(share * 1e6) * len(ordered) // 1_000_000) - 1)]
