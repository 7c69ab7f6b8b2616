"""Effects of the potentiometer, and of the controller and its timing."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter, JointScale


def _bend(scale: JointScale) -> float:
    return 0.0025 * scale.range


def _upper_limit(scale: JointScale) -> float:
    return 0.1 * scale.range


def _lower_limit(scale: JointScale) -> float:
    return -0.1 * scale.range


SENSOR = (
    Effect(
        "potentiometer_gain",
        physics="reading = q + g (q − middle of the range)",
        source="assumed: calibration error of a potentiometer's scale",
        parameters=(EffectParameter("relative", at.POTENTIOMETER_GAIN, "1", low=-0.5, high=0.5, deviation=0.03),),
    ),
    Effect(
        "potentiometer_offset",
        physics="reading = q + o",
        source="assumed: calibration error of a potentiometer's zero",
        parameters=(
            EffectParameter(
                "offset",
                at.POTENTIOMETER_OFFSET,
                "rad",
                low=_lower_limit,
                high=_upper_limit,
                deviation=lambda s: 10 * s.resolution,
            ),
        ),
    ),
    Effect(
        "potentiometer_nonlinearity",
        physics="reading = q + Σ b_k sin(kπx), x = 0 to 1 over the range",
        source="section 6.2: ±0.25 % linearity of the plastic film, as the first terms of a sine series",
        parameters=tuple(
            EffectParameter(f"bend_{k}", column, "rad", low=_lower_limit, high=_upper_limit, deviation=_bend)
            for k, column in enumerate(at.BENDS, start=1)
        ),
    ),
)
"""Effects of the sensor family."""


# --- Effects of the controller and its timing


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
