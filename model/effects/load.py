"""Effects of masses, their location, and gravity."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter

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
