"""Friction effects. All oppose motion. z is the deflection of the contact; while sliding, the sign of the motion."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter, JointScale, torque_parameter


def noticeable_damping(scale: JointScale) -> float:
    """Returns the expected deviation of viscous friction (N·m·s/rad, motor side).

    The larger of a third of the stated value and 2 % of rated torque over no-load speed.
    """
    return max(scale.viscous / 3, 0.02 * scale.torque / scale.speed / scale.gear**2)


FRICTION = (
    Effect(
        "viscous_friction",
        physics="τ = −n² v_eff q̇, v_eff on the motor's side",
        source="(7.30)",
        parameters=(
            EffectParameter(
                "coefficient",
                at.VISCOUS,
                "N·m·s/rad",
                low=0.0,
                deviation=noticeable_damping,
            ),
        ),
    ),
    Effect(
        "quadratic_drag",
        physics="τ = −k |q̇| q̇; beside viscous friction, k < 0 is a coefficient that falls with speed",
        source="drag of a fluid; k < 0: Waiboer, Aarts and Jonker 2005, ECCOMAS Multibody (power of speed below 1)",
        parameters=(
            EffectParameter(
                "coefficient",
                at.DRAG,
                "N·m·s²/rad²",
                deviation=lambda s: s.gear**2 * noticeable_damping(s) / s.speed,
            ),
        ),
    ),
    Effect(
        "coulomb_friction",
        physics="τ = −T_c z",
        source="Coulomb 1785; contact as an elastic, perfectly plastic element (Prandtl 1928)",
        parameters=(torque_parameter("torque", at.COULOMB, only_against=True),),
    ),
    Effect(
        "load_dependent_friction",
        physics="τ = −μ̃ N(q) z with N the gravity force that presses on the joint; μ̃ is an arm",
        source="(7.32) to (7.34) in magnitude; on other machines N is the weight beyond the joint across its axis",
        parameters=(EffectParameter("arm", at.COULOMB_ARM, "m", low=0.0, high=1.0, deviation=0.043),),
    ),
    Effect(
        "gravity_torque_friction",
        physics="τ = −μ |G(q)| z: friction in proportion to the gravity torque of the joint",
        source="Bittencourt and Gunnarsson 2012, J. Dyn. Sys. Meas. Control 134(5): friction by load torque",
        parameters=(EffectParameter("share", at.GRAVITY_SHARE, "1", low=0.0, high=1.0, deviation=0.1),),
    ),
    Effect(
        "stribeck_friction",
        physics="τ = −F_s exp(−|q̇|/V) z: friction F_s above its value at speed, falling over V",
        source="(7.31)",
        parameters=(
            torque_parameter("torque", at.STRIBECK, only_against=True),
            EffectParameter(
                "speed",
                at.STRIBECK_SPEED,
                "rad/s",
                null=None,
                start=lambda s: 0.03 * s.speed,
                low=1e-3,
                high=lambda s: s.fastest,
                deviation=lambda s: 0.02 * s.speed,
            ),
        ),
    ),
    Effect(
        "stiction",
        physics="at rest the joint holds T_b above Coulomb friction, then breaks away; it sticks again when it stops",
        source="Karnopp 1985 (stick as a state of its own)",
        parameters=(torque_parameter("breakaway", at.BREAKAWAY, only_against=True),),
        flag=at.HAS_STICTION,
    ),
    Effect(
        "direction_dependent_friction",
        physics="τ = −|ΔT| z where ΔT z > 0: friction is ΔT higher forwards, or |ΔT| backwards where ΔT is negative",
        source="Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, section 2.2",
        parameters=(torque_parameter("difference", at.DIRECTION),),
    ),
    Effect(
        "direction_dependent_viscous_friction",
        physics="τ = −n² |Δv| q̇ where Δv q̇ > 0, with q̇ the link's speed, where viscous friction has the rotor's: "
        "v_eff is Δv higher forwards, or |Δv| backwards where Δv is negative",
        source="Canudas de Wit, Åström and Braun 1987, IEEE J. Robotics and Automation 3(6)",
        parameters=(EffectParameter("difference", at.VISCOUS_DIRECTION, "N·m·s/rad", deviation=noticeable_damping),),
    ),
)
"""Effects of the friction family."""
