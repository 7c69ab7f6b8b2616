"""The report of a fit of recorded torques."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from model.base_parameters.result import BaseParameters
from model.blocks import Cell, Picture, Report, Section, Table, Text, cells
from model.discrepancy.explanation.notes import note_words, on_drives_at_limit
from model.discrepancy.explanation.step_words import sentence
from model.fitting.fitted import parameter_table
from model.inverse_dynamics.fit import TorqueCurves, TorqueFit
from model.reports.base_parameter_blocks import base_parameter_section
from model.reports.figures import COLOURS, INK, baseline, drawn, panels, thinned
from model.reports.fit_report import interval_picture, undetermined_blocks
from model.reports.page import effect_list, listed, record_sections, trace_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure


RESIDUAL = "Error and residual: torque that the model needs − torque that the recorded drive gave."
"""At the foot of the page."""


def torque_report(
    found: TorqueFit,
    curves: Sequence[TorqueCurves],
    base: BaseParameters | None = None,
    files: Mapping[str, str] | None = None,
) -> Report:
    """Returns the page; `curves` are those of the fitted model on the traces to draw, `base` its base parameters on
    those that were fitted to, `files` the names of the traces' files by number, where they are known."""
    files = files or {}
    machine = found.model.machine
    sections = (
        Section("Parameters", (parameter_table(found.parameters), *interval_picture(found.model, found.parameters))),
        Section("What the traces cannot tell", undetermined_blocks(found.identifiability)),
        *(() if base is None else (base_parameter_section(base),)),
        Section(
            "What is left of the torque",
            (*_at_limit(found), _error_table(found, files), *(_picture(c, found, files) for c in curves)),
        ),
        Section("How it was done", (_how(found),)),
    )
    fitted, held = ([e.trace for e in found.errors if e.held_out is kind] for kind in (False, True))
    facts = (
        ("machine", machine.title),
        ("model", f"{found.model.identity}, from {found.model.lineage.parent or 'none'}"),
        ("effects", effect_list([use.name for use in found.model.effects])),
        ("fitted to", listed(trace_names(fitted, files))),
        ("held out", listed(trace_names(held, files)) if held else "none"),
        ("search", f"{found.evaluations} evaluations; {'converged' if found.converged else 'did not converge'}"),
    )
    return Report(
        f"Fit of torques of {machine.title}",
        _answer(found),
        facts,
        (*record_sections(found.record), *sections),
        RESIDUAL,
    )


def _answer(found: TorqueFit) -> str:
    known = sum(p.verdict == "known" for p in found.parameters)
    held = "" if found.held_out is None else f", {100 * found.held_out:.1f} % on those held out"
    verdict = "" if found.verdict is None else f"{found.verdict.text} "
    return (
        f"{verdict}The traces determine {known} of {len(found.parameters)} parameters. Left of the torque: "
        f"{100 * found.in_sample:.1f} % on the traces fitted to{held}."
    )


def _at_limit(found: TorqueFit) -> tuple[Text, ...]:
    """Drives that stood at limits that the file does not state, with their share of the time."""
    return tuple(
        Text(sentence(note_words(note)), "warning") for note in on_drives_at_limit(found.at_limit, found.unknown_joints)
    )


def _error_table(found: TorqueFit, files: Mapping[str, str]) -> Table:
    rows = []
    for one, name in zip(found.errors, trace_names([e.trace for e in found.errors], files), strict=True):
        for joint, left, torque in zip(found.model.machine.modelled_joints, one.rms, one.torque, strict=True):
            kind = Cell("held out" if one.held_out else "in sample")
            rows.append((Cell(name), kind, *cells(str(joint), f"{left:.4g}", f"{torque:.4g}")))
    return Table(
        ("trace", "", "joint", "rms left", "rms of the torque"),
        tuple(rows),
        "In N·m (N on a prismatic joint): torque that the model needs for the motion − torque of the recorded drive.",
    )


def _picture(one: TorqueCurves, found: TorqueFit, files: Mapping[str, str]) -> Picture:
    def draw(figure: Figure) -> None:
        for axes, column, joint in zip(
            panels(figure, 1, len(one.joints))[0], range(len(one.joints)), one.joints, strict=True
        ):
            time, recorded, left = thinned(one.time, one.recorded[:, column], one.left[:, column])
            axes.plot(time, recorded, color=INK, lw=0.9, label="recorded")
            axes.plot(time, left, color=COLOURS[(joint - 1) % len(COLOURS)], lw=0.9, label="left")
            baseline(axes)
            axes.set_title(f"joint {joint}")
            axes.set_xlabel("time / s")
            unit = "N·m" if found.model.machine.joint(joint).kind == "revolute" else "N"
            axes.set_ylabel(f"torque / {unit}" if unit == "N·m" else "force / N")
            axes.legend()

    return Picture(
        drawn(draw, 2.4),
        f"{trace_names([one.trace], files)[0]}: torque of the recorded drive, and what the model leaves of it.",
    )


def _how(found: TorqueFit) -> Table:
    rows = (
        ("low-pass", f"{found.cutoff:g} Hz, forwards and backwards, on positions and torques alike"),
        ("residual", "torque that the motion needs by the model, less torque of the recorded drive"),
        ("intervals", "whitened residual, and a covariance that holds where whitening was not enough"),
    )
    return Table(("setting", "value"), tuple((Cell(n), Cell(v)) for n, v in rows))
