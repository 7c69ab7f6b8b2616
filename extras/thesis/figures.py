"""Figures 7.12 to 7.14: elements of D, inertial and gravity torques along the experiment's motion."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from extras.thesis.check import Check
from extras.thesis.influence import Influence, influences
from extras.thesis.tables import (
    INFLUENCE_FAST_WAIST,
    INFLUENCE_SLOW_WAIST,
    RODS_INFLUENCE,
    VISCOUS_AND_COULOMB,
    model_of,
)
from extras.thesis.torques import TorqueAnalysis, largest, torques_of_run
from model.dynamics.inertial_influence import PARAMETERS, parameter_name, parameters_about_joint
from model.kinematics.chain import Chain, Joint, Link, inertia_about


class TorqueFigures(FrozenRecord):
    """Torques along the simulated motion of a trace's set points, and the source's statements on them."""

    analysis: TorqueAnalysis
    checks: tuple[Check, ...]


def torque_figures(trace: Trace) -> TorqueFigures:
    """Computes figures 7.12 to 7.14 with the parameters of table 7.9, link 3 by (7.28). Raises as `simulate` does."""
    analysis = torques_of_run(model_of(VISCOUS_AND_COULOMB, trace.record.machine or load_machine("ma2000")), trace)
    d = {(e.row, e.column): largest(e.whole) for e in analysis.inertia}
    coupling = [abs(x) for x in analysis.element(2, 3).whole]
    gravity = {g.joint: g for g in analysis.gravity}
    by_gravity = largest(gravity[2].by_link[2])
    by_inertia = max(largest(t.values) for t in analysis.inertial if t.at != t.of)
    return TorqueFigures(
        analysis=analysis,
        checks=(
            Check(
                name="D12 and D13 are very small",
                holds=max(d[1, 2], d[1, 3]) < 1e-3 * d[1, 1],
                ours=f"at most {max(d[1, 2], d[1, 3]):.2g} of D11 = {d[1, 1]:.3g} kg·m²",
                published="very small (figure 7.12)",
            ),
            Check(
                name="D22 is much larger than D23",
                holds=d[2, 2] > 5 * d[2, 3],
                ours=f"{d[2, 2]:.3g} against {min(coupling):.3f} to {max(coupling):.3f} kg·m²",
                published="much larger (figure 7.12)",
            ),
            Check(
                name="joints interact mainly through gravity",
                holds=by_gravity > 2 * by_inertia,
                ours=f"link 3 weighs {by_gravity:.3g} N·m on joint 2, inertia couples at most {by_inertia:.3g} N·m",
                published="mainly gravity torques (figures 7.13, 7.14)",
            ),
        ),
    )


def influence_tables() -> tuple[Influence, ...]:
    """Returns tables 5.1 to 5.3 beside the dynamics of the arm's geometry: bodies of any shape, then rods (5.3).

    In table 5.3 entries are by link: the parameters that are not zero and act on any joint.
    """
    general = Chain(GEOMETRY, tuple(_any_body(k) for k in range(3)))
    return (
        *influences(general, "5.1", INFLUENCE_FAST_WAIST),
        *influences(general, "5.2", INFLUENCE_SLOW_WAIST, waist_still=True),
        *_rods(),
    )


GEOMETRY = (Joint(alpha=math.pi / 2), Joint(a=0.285755), Joint(a=0.168410))
"""D-H parameters of the three joints with the lengths of table 7.9."""


def _any_body(seed: int) -> Link:
    """Returns a body without symmetry, made of points, so that every inertial parameter matters."""
    rng = np.random.default_rng(seed)
    points, masses = rng.normal(scale=0.3, size=(5, 3)), rng.uniform(0.1, 0.5, size=5)
    centre = masses @ points / masses.sum()
    inertia = sum(
        (inertia_about(float(m), r, np.zeros((3, 3))) for m, r in zip(masses, points - centre, strict=True)),
        np.zeros((3, 3)),
    )
    return Link(float(masses.sum()), centre, inertia)


def _rods() -> tuple[Influence, ...]:
    chain = VISCOUS_AND_COULOMB.arm().body.chain()
    acting = {p for joint in influences(chain, "5.3", RODS_INFLUENCE) for p in joint.acting}
    found = []
    for link, named in enumerate(RODS_INFLUENCE, start=1):
        own = parameters_about_joint(chain, link)
        names = [parameter_name(link, k) for k in range(len(PARAMETERS)) if abs(own[k]) > 1e-12]
        found.append(
            Influence(
                table="5.3", joint=link, acting=tuple(n for n in names if n in acting), published=tuple(sorted(named))
            )
        )
    return tuple(found)
