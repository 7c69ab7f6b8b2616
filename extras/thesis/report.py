"""The report of the reproduced source: our results beside the published ones, by table and figure.

Figures 7.12 to 7.14: elements of D, gravity and inertial torques along the experiment's motion.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from extras.thesis.control_cases import ControlCase, ControlChapter
from extras.thesis.ladder import Ladder
from extras.thesis.reproduction import Reproduction
from extras.thesis.tables import SYMBOLS
from extras.thesis.torques import TorqueAnalysis
from model.blocks import Cell, Picture, Points, Report, Section, Table, Text, cells
from model.reports.figures import COLOURS, QUIET, baseline, drawn, panels, thinned

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def torque_section(found: TorqueAnalysis) -> Section:
    """Returns the three figures for any machine and motion."""
    time = np.array(found.time)
    return Section(
        "Figures 7.12 to 7.14: inertia and torques along the motion",
        (_inertia(found, time), _gravity(found, time), _inertial(found, time)),
    )


def _inertia(found: TorqueAnalysis, time: np.ndarray) -> Picture:
    def draw(figure: Figure) -> None:
        columns = 3
        largest = max(max(map(abs, element.whole)) for element in found.inertia)
        rows = -(-len(found.inertia) // columns)
        axes = panels(figure, rows, columns, sharex=True)
        for place, element in enumerate(found.inertia):
            own = axes.flat[place]
            own.plot(time, element.whole, color=COLOURS[0], label="whole")
            own.plot(time, element.translation, color=COLOURS[1], lw=0.9, ls="--", label="translation")
            own.plot(time, element.rotation, color=COLOURS[2], lw=0.9, ls=":", label="rotation")
            if max(map(abs, element.whole)) < 1e-3 * largest:
                own.set_ylim(-1e-3 * largest, 1e-3 * largest)
            own.set_title(f"D{element.row}{element.column} / kg·m²")
        for empty in axes.flat[len(found.inertia) :]:
            empty.set_visible(False)
        for last in axes[-1]:
            last.set_xlabel("time / s")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)

    return Picture(drawn(draw, 3.2), "Elements of the inertia matrix: translation and rotation of the bodies (7.12).")


def _gravity(found: TorqueAnalysis, time: np.ndarray) -> Picture:
    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(found.gravity), sharey=True)[0]
        for own, joint in zip(axes, found.gravity, strict=True):
            own.plot(time, joint.whole, color=COLOURS[0], label="all")
            for k, link in enumerate(joint.by_link):
                own.plot(time, link, color=COLOURS[(k + 1) % len(COLOURS)], lw=0.9, ls="--", label=f"link {k + 1}")
            baseline(own)
            own.set_title(f"joint {joint.joint}")
            own.set_xlabel("time / s")
        axes[0].set_ylabel("gravity torque / N·m")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))

    return Picture(drawn(draw, 2.2), "Torque of gravity at each joint, whole and by link (7.14).")


def _inertial(found: TorqueAnalysis, time: np.ndarray) -> Picture:
    joints = sorted({t.at for t in found.inertial})

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(joints), sharey=True)[0]
        for own, joint in zip(axes, joints, strict=True):
            for torque in found.inertial:
                if torque.at == joint:
                    colour = COLOURS[(torque.of - 1) % len(COLOURS)]
                    own.plot(time, torque.values, color=colour, label=f"acceleration of joint {torque.of}", lw=1.2)
            baseline(own)
            own.set_title(f"joint {joint}")
            own.set_xlabel("time / s")
        axes[0].set_ylabel("inertial torque / N·m")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))

    return Picture(drawn(draw, 2.2), "Torque at each joint from the acceleration of each: own and interaction (7.13).")


METHODS = {"nelder_mead": "Nelder and Mead, as in the source", "least_squares": "least squares with exact Jacobians"}


def thesis_report(found: Reproduction) -> Report:
    """Returns the page of the reproduction, to be read beside the thesis."""
    borne_out = len(found.checks) - len(found.failed)
    sections = [
        Section("What the source says, and whether it comes out", (_checks(found),)),
        Section("Σλ² from the published tables", (_sums(found),)),
        *(_ladder(ladder) for ladder in found.ladders),
        torque_section(found.figures.analysis),
        _control(found.control),
        Section("Tables 5.1 to 5.3: which inertial parameters act", (_influence(found),)),
        Section("What the source does not give, and what was taken", (_choices(found),)),
        Section("Found on the way", (Points(found.findings),)),
    ]
    failed = "; ".join(c.name for c in found.failed)
    answer = f"{borne_out} of {len(found.checks)} statements of the source come out." + (
        f" Not: {failed}." if failed else ""
    )
    facts = (
        ("source", "I. H. Kartowisastro, City University London, 1991"),
        ("traces", ", ".join(found.ladders[0].traces)),
        ("fitted by", " and ".join(METHODS[ladder.method] for ladder in found.ladders)),
    )
    return Report("The thesis reproduced", answer, facts, tuple(sections))


def _checks(found: Reproduction) -> Table:
    verdicts = {True: Cell("yes", "good"), False: Cell("no", "warning")}
    rows = tuple((Cell(c.name), verdicts[c.holds], Cell(c.ours), Cell(c.published, "quiet")) for c in found.checks)
    return Table(("statement", "holds", "ours", "published"), rows)


def _sums(found: Reproduction) -> Table:
    source = [f for f in found.fidelity if f.convention == "source"]
    three = {f.name: f for f in found.fidelity if f.convention == "three_sigma"}
    rows = []
    for f in source:
        ours, other = (f"{one.ours:.4f}" for one in (f, three[f.name]))
        sums = (f"{f.published:.4f}", ours, f"{100 * f.relative_difference:+.1f} %", other)
        rows.append(cells(f"{f.name} (tables {f.table}, {f.deviation_table})", *sums))
    head = ("model", "published", "τ′ = â/(3√2)", "difference", "τ′ = â/3")
    caption = "The sum from the printed values and standard deviations, with both readings of the expected deviation."
    return Table(head, tuple(rows), caption)


def _ladder(ladder: Ladder) -> Section:
    rows = [
        _pairs("MSQE / rad²", [(s.error, s.published_error) for s in ladder.steps]),
        _pairs("Σλ²", [(s.fidelity.sum_of_contributions, s.published_sum) for s in ladder.steps]),
    ]
    for symbol in SYMBOLS:
        pairs = [
            (s.values[symbol.name], s.published_values[symbol.name]) if symbol.name in s.values else None
            for s in ladder.steps
        ]
        rows += [_pairs(f"{symbol.name} / {symbol.unit}", pairs)]
    head = ("", *(name for s in ladder.steps for name in (s.name, "published")))
    unoptimised = (
        f"Before any fit the error is {ladder.unoptimised_error:.4g} rad², 2.1428e-3 in the source (table 7.2)."
    )
    table = Table(head, tuple(rows), "Tables 7.3 to 7.10, ours beside the published.")
    blocks = (Text(unoptimised), table, _ladder_picture(ladder))
    return Section(f"The four models, fitted by {METHODS[ladder.method]}", blocks)


def _pairs(name: str, pairs: list[tuple[float, float] | None]) -> tuple[Cell, ...]:
    row = [Cell(name)]
    for pair in pairs:
        ours, published = ("", "") if pair is None else (f"{pair[0]:.4g}", f"{pair[1]:.4g}")
        row += [Cell(ours, number=True), Cell(published, "quiet", number=True)]
    return tuple(row)


def _ladder_picture(ladder: Ladder) -> Picture:
    steps = ladder.steps
    names = [s.name for s in steps]

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 3)[0]
        _two(axes[0], names, [s.error for s in steps], [s.published_error for s in steps], "MSQE / rad²", log=True)
        sums = [s.fidelity.sum_of_contributions for s in steps]
        _two(axes[1], names, sums, [s.published_sum for s in steps], "Σλ²", log=True)
        axes[1].axhline(1.0, color=QUIET, lw=0.8, ls=(0, (4, 2)))
        back = [s.values.get("Kb2", math.nan) for s in steps]
        published = [s.published_values.get("Kb2", math.nan) for s in steps]
        _two(axes[2], names, back, published, "K_b2 / V·s/rad", log=False)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)

    caption = (
        "The error falls and Σλ² rises from model to model; K_b2 inflates where friction is missing. The mock's arm "
        "has less unmodelled in it than the arm of 1991, so its errors are smaller."
    )
    return Picture(drawn(draw, 2.5), caption)


def _two(axes: object, names: list[str], ours: list[float], published: list[float], title: str, log: bool) -> None:
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
    axes.plot(names, ours, "o-", color=COLOURS[0], label="ours", ms=4)
    axes.plot(names, published, "s--", color=COLOURS[1], label="published", ms=4)
    axes.set_title(title)
    axes.tick_params(axis="x", rotation=30, labelsize=7)
    if log:
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0.0)


def _control(chapter: ControlChapter) -> Section:
    rows = tuple(_control_row(case) for case in chapter.cases)
    head = ("run", "amplitude, first period", "amplitude, last period", "rms error / °", "overshoot / °")
    table = Table(head, rows, "Joints 1/2/3. Amplitude: swing of the position over that of the wanted motion.")
    return Section("Chapter 8: partitioned control and PID", (table, *(_control_picture(c) for c in chapter.cases)))


def _control_row(case: ControlCase) -> tuple[Cell, ...]:
    degrees = [[math.degrees(v) for v in triple] for triple in (case.rms, case.overshoot)]
    return cells(
        case.name,
        *("/".join(f"{v:.2f}" for v in triple) for triple in (case.first_amplitude_ratio, case.amplitude_ratio)),
        *("/".join(f"{v:.1f}" for v in triple) for triple in degrees),
    )


def _control_picture(case: ControlCase) -> Picture:
    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 3)[0]
        for j in range(3):
            time, wanted, position = thinned(
                np.array(case.time), np.degrees(case.wanted[j]), np.degrees(case.position[j]), most=600
            )
            axes[j].plot(time, wanted, color=QUIET, lw=0.9, ls=(0, (4, 2)), label="wanted")
            axes[j].plot(time, position, color=COLOURS[j], lw=1.2, label="position")
            axes[j].set_title(f"joint {j + 1}", color=COLOURS[j])
            axes[j].set_xlabel("time / s")
        axes[0].set_ylabel("position / °")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)

    return Picture(drawn(draw, 1.95), f"{case.name}.")


def _influence(found: Reproduction) -> Table:
    rows = []
    for entry in found.influence:
        where = f"link {entry.joint}" if entry.table == "5.3" else f"joint {entry.joint}"
        differing = (entry.published_too_many, entry.published_too_few)
        differences = (Cell(", ".join(p) or "–", "warning" if p else "plain") for p in differing)
        rows.append((Cell(f"{entry.table}, {where}"), Cell(", ".join(entry.acting)), *differences))
    return Table(("table", "acting", "named by the source, without effect", "missing in the source"), tuple(rows))


def _choices(found: Reproduction) -> Table:
    rows = tuple((Cell(c.what), Cell(c.value), Cell(c.why, "quiet")) for c in found.choices)
    return Table(("what", "taken", "why"), rows)
