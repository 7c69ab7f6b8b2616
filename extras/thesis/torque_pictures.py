"""Figures 7.12 to 7.14: elements of D, gravity and inertial torques along the experiment's motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from extras.thesis.torques import TorqueAnalysis
from model.blocks import Picture, Section
from model.reports.figures import COLOURS, baseline, drawn, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def torque_section(found: TorqueAnalysis) -> Section:
    """The three figures for any machine and motion."""
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
