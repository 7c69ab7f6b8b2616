"""Effects of masses, their location, gravity, and external torques."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter, Tone, torque_parameter

LOAD = (
    Effect(
        "payload",
        physics="MLOAD → MLOAD + m at the end of the last link",
        source="section 7.2",
        parameters=(EffectParameter("mass", at.PAYLOAD, "kg", low=-10.0, high=50.0, deviation=0.3),),
        whole_machine=True,
        group="load",
    ),
    Effect(
        "link_mass",
        physics="m_i → m_i + m, of the same shape",
        source="section 7.2",
        parameters=(
            EffectParameter(
                "added", at.MASS_ADDED, "kg", low=lambda s: -0.99 * s.mass, high=50.0, deviation=lambda s: 0.5 * s.mass
            ),
        ),
    ),
    Effect(
        "centre_of_mass",
        physics="c̄_i → c̄_i + s along the link, inertia about the centre unchanged",
        source="section 7.2; appendix B",
        parameters=(
            EffectParameter(
                "shift",
                at.SHIFT,
                "m",
                low=lambda s: -0.5 * s.length,
                high=lambda s: 0.5 * s.length,
                deviation=lambda s: 0.2 * s.length,
            ),
        ),
    ),
    Effect(
        "base_tilt",
        physics="gravity turned by −φ_x about the base's x axis, then −φ_y about its y axis",
        source="rotation of the gravity vector in (3.30)",
        parameters=(
            EffectParameter("about_x", at.TILT_X, "rad", low=-1.6, high=1.6, deviation=0.05),
            EffectParameter("about_y", at.TILT_Y, "rad", low=-1.6, high=1.6, deviation=0.05),
        ),
        whole_machine=True,
    ),
)
"""Effects of the inertia and gravity families."""


# --- Effects of external torques


EXTERNAL = (
    Effect(
        "spring_torque",
        physics="τ = −k (q − q_0)",
        source="Hooke; a cable or hose",
        parameters=(
            EffectParameter(
                "stiffness",
                at.SPRING,
                "N·m/rad",
                low=lambda s: -s.strongest,
                high=lambda s: 10 * s.strongest,
                deviation=lambda s: 0.05 * s.torque,
            ),
            EffectParameter("rest", at.SPRING_REST, "rad", null=None, start=0.0, low=-10.0, high=10.0, deviation=1.0),
        ),
    ),
    Effect(
        "one_sided_spring",
        physics="τ = −|k| (q − q_0) where k (q − q_0) > 0: it pulls beyond q_0, or, where k < 0, before it",
        source="Hooke; a cable that hangs slack on one side of q_0, or an elastic stop",
        parameters=(
            EffectParameter(
                "stiffness",
                at.CABLE,
                "N·m/rad",
                low=lambda s: -10 * s.strongest,
                high=lambda s: 10 * s.strongest,
                deviation=lambda s: 0.05 * s.torque,
            ),
            EffectParameter("rest", at.CABLE_REST, "rad", null=None, start=0.0, low=-10.0, high=10.0, deviation=1.0),
        ),
    ),
    Effect(
        "constant_torque",
        physics="τ = T",
        source="a preload, a counterweight on an axis that stays level, or an offset of a current or torque sensor",
        parameters=(torque_parameter("torque", at.CONSTANT_TORQUE),),
    ),
    # Its phase counts from the start of the first record; every other one has a phase of its own
    # (`model.fitting.phases`).
    Effect(
        "periodic_disturbance",
        physics="τ = a sin(2πft) + b cos(2πft), t from the start of the record",
        source="harmonic force",
        tone=Tone.OVER_TIME,
        parameters=(
            torque_parameter("sine", at.DISTURBANCE_SINE),
            torque_parameter("cosine", at.DISTURBANCE_COSINE),
            EffectParameter(
                "frequency",
                at.DISTURBANCE_FREQUENCY,
                "Hz",
                null=None,
                start=1.0,
                low=0.05,
                high=lambda s: 0.5 / s.period,
                deviation=1.0,
            ),
        ),
    ),
)
"""Effects of the external family."""
