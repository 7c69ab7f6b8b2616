"""Effects between motor and joint."""

from __future__ import annotations

import math

from model import layout as at
from model.effects.effect import Effect, EffectParameter, JointScale, Tone, torque_parameter

CONTACT_RATE = 1500.0
"""Highest natural frequency (rad/s) of parts in contact. Steps of 1 ms can follow it (RK4 is stable up to 2785)."""
CONTACT_DAMPING = 0.1
"""Damping ratio of that oscillation: an assumption."""


def _damping(scale: JointScale) -> float:
    return 2 * CONTACT_DAMPING * CONTACT_RATE * scale.inertia


def contact_compliance(scale: JointScale) -> float:
    """Returns the compliance of a contact that oscillates at `CONTACT_RATE`, rad/(N·m)."""
    return 1.0 / (CONTACT_RATE**2 * scale.inertia)


def _noticeable_compliance(scale: JointScale) -> float:
    """Returns the compliance at which a joint yields by two counts under a twentieth of its rated torque."""
    return 2 * scale.resolution / (0.05 * scale.torque)


def _softest_contact(scale: JointScale) -> float:
    """Returns the upper bound of a contact's compliance, rad/(N·m).

    The torque of a plain gain is not known without a record.
    """
    known = scale.torque == scale.strongest
    return contact_compliance(scale) + 10 * _noticeable_compliance(scale) if known else math.inf


_DAMPING = EffectParameter(
    "damping",
    at.TRANSMISSION_DAMPING,
    "N·m·s/rad",
    null=None,
    start=_damping,
    low=0.0,
    high=lambda s: 10 * _damping(s),
    deviation=_damping,
)
TRANSMISSION = (
    Effect(
        "torque_ripple",
        physics="τ = a sin(N q) + b cos(N q)",
        source="cogging of motor or gear, first harmonic",
        tone=Tone.OVER_POSITION,
        parameters=(
            torque_parameter("sine", at.RIPPLE_SINE),
            torque_parameter("cosine", at.RIPPLE_COSINE),
            EffectParameter(
                "cycles", at.RIPPLE_CYCLES, "1", null=None, start=12.0, low=0.5, high=1000.0, deviation=6.0
            ),
        ),
    ),
    Effect(
        "gear_loss",
        physics="τ = −κ |n K_T i − n² v_eff q̇_m| z: a share κ of the torque that the gear transmits is lost",
        source="load-dependent gear friction, as an efficiency 1 − κ",
        parameters=(EffectParameter("loss", at.GEAR_LOSS, "1", low=0.0, high=0.95, deviation=0.1),),
    ),
    Effect(
        "direction_dependent_gear_loss",
        physics="τ = −|Δκ| |T| z where Δκ T z > 0, T the torque through the gear: lost while the motor drives, or, "
        "where Δκ < 0, while it is driven",
        source="Hamon, Gautier and Garrec 2010, IROS: friction by load, another while the motor brakes",
        parameters=(EffectParameter("difference", at.GEAR_LOSS_DIRECTION, "1", low=-0.95, high=0.95, deviation=0.1),),
    ),
    Effect(
        "backlash",
        physics="no torque while |q_m − q| < g/2, an elastic contact beyond; rotor and link move apart",
        source="Nordin and Gutman 2002, dead-zone model",
        parameters=(
            EffectParameter(
                "gap", at.GAP, "rad", low=0.0, high=lambda s: 0.1 * s.range, deviation=lambda s: 6 * s.resolution
            ),
            _DAMPING,
            EffectParameter(
                "contact",
                at.CONTACT_COMPLIANCE,
                "rad/(N·m)",
                null=None,
                start=contact_compliance,
                low=contact_compliance,
                high=_softest_contact,
                deviation=_noticeable_compliance,
            ),
        ),
        flag=at.HAS_FLEXIBILITY,
    ),
    Effect(
        "joint_compliance",
        physics="τ = (q_m − q)/c + d (q̇_m − q̇) between rotor and link; with backlash on the same joint, one d for both",
        source="Spong 1987, elastic joints",
        parameters=(
            EffectParameter(
                "compliance",
                at.COMPLIANCE,
                "rad/(N·m)",
                low=0.0,
                high=lambda s: 0.1 * s.range / (s.torque / 20) if s.torque == s.strongest else math.inf,
                deviation=lambda s: 6 * s.resolution / (0.05 * s.torque),
            ),
            _DAMPING,
        ),
        flag=at.HAS_FLEXIBILITY,
    ),
)
"""Effects of the transmission family."""
