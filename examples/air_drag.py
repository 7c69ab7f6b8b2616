"""A paddle in the air at the end of an arm: a torque against the motion, with the square of the speed."""

from ma2000.own_effects import OwnEffect, OwnParameter, magnitude


def torque(speed, coefficient):
    return -coefficient * magnitude(speed) * speed


EFFECT = OwnEffect(
    name="air_drag",
    physics="τ = −k |q̇| q̇",
    source="quadratic drag; k = ½ ρ c A r³ for a flat plate at radius r",
    parameters=(OwnParameter("coefficient", unit="N·m·s²/rad²", null=0.0, low=0.0, high=1.0, deviation=0.02),),
    torque=torque,
)
