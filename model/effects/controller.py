"""Effects of the controller and its timing."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter

CONTROL = (
    Effect(
        "input_delay",
        physics="the drive of a period acts t later; any part of a period, up to 14 periods",
        source="computing and transport delay",
        parameters=(
            EffectParameter(
                "time", at.EXTRA_DELAY, "s", low=0.0, high=lambda s: 13 * s.period, deviation=lambda s: s.period
            ),
        ),
    ),
    Effect(
        "wrong_gain",
        physics="power → power (1 + g)",
        source="section 6.4: adjustable gains are not the physical ones",
        parameters=(EffectParameter("relative", at.GAIN_ERROR, "1", low=-0.95, high=5.0, deviation=0.2),),
    ),
    Effect(
        "lost_set_points",
        physics="set point → (1 − f) of this period and f of the one before: a share f is lost, on average",
        source="section 6.5: the controller takes no set points while the host holds the memory",
        parameters=(EffectParameter("share", at.LOST, "1", low=0.0, high=1.0, deviation=0.2),),
    ),
)
"""Effects of the controller family."""
