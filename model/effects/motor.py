"""Effects of motor and amplifier."""

from __future__ import annotations

from model import layout as at
from model.effects.effect import Effect, EffectParameter

LONGEST_ELECTRICAL = 0.05
"""Longest electrical time constant L/R of a winding, s: 0.1 to 10 ms in servo motors, a few tens above a kilowatt."""

MOTOR = (
    Effect(
        "weakened_magnet",
        physics="K_T → K_T (1 − ε), K_b → K_b (1 − ε)",
        source="permanent magnets lose flux by heat and by large currents; K_T and K_b are of one flux",
        parameters=(EffectParameter("loss", at.FLUX_LOSS, "1", low=0.0, high=0.95, deviation=0.2),),
    ),
    Effect(
        "resistance_drift",
        physics="R → R (1 + x), ẋ = h i² − x/T: the winding warms",
        source="first-order heat balance; copper gains 0.39 % per kelvin",
        parameters=(
            # Upper bound: a winding of 10 mA that gains a tenth in a hundredth of a second. Small motors draw few
            # amperes.
            EffectParameter("heating", at.HEATING, "1/(A²·s)", low=0.0, high=1e5, deviation=0.005),
            EffectParameter(
                "time_constant", at.COOLING_TIME, "s", null=None, start=60.0, low=1.0, high=3600.0, deviation=40.0
            ),
        ),
    ),
    Effect(
        "resistance_rise",
        physics="R → R (1 + r (1 − exp(−t/T))), t from the start of the record",
        source="a winding that its housing or a neighbour warms, of one thermal mass; copper gains 0.39 % per kelvin",
        parameters=(
            EffectParameter("rise", at.TIMED_RISE, "1", low=-0.5, high=2.0, deviation=0.2),
            EffectParameter(
                "time_constant", at.RISING_TIME, "s", null=None, start=60.0, low=1.0, high=3600.0, deviation=40.0
            ),
        ),
    ),
    Effect(
        "motor_inductance",
        physics="L di/dt = u − R i − K_b n q̇, advanced by its exact exponential",
        source="(3.55), table 7.1",
        parameters=(
            EffectParameter(
                "inductance",
                at.INDUCTANCE,
                "H",
                null=0.0,
                start=lambda s: 2e-4 * s.resistance,
                low=lambda s: 1e-8 * s.resistance,
                high=lambda s: LONGEST_ELECTRICAL * s.resistance,
                deviation=lambda s: 2e-3 * s.resistance,
            ),
        ),
        flag=at.HAS_INDUCTANCE,
    ),
    Effect(
        "dead_zone",
        physics="u = 0 for |u_c| < w, else u_c − w sign(u_c)",
        source="input dead zone of a linear amplifier; in volts at the motor",
        parameters=(
            EffectParameter(
                "width", at.DEAD_ZONE, "V", low=0.0, high=lambda s: s.highest, deviation=lambda s: 0.03 * s.volts
            ),
        ),
    ),
    Effect(
        "amplifier_threshold",
        physics="u = 0 for |u_c| ≤ w, else u_c",
        source="least pulse of a switched output stage, or an input threshold; in commanded volts",
        parameters=(
            EffectParameter(
                "width", at.THRESHOLD, "V", low=0.0, high=lambda s: s.highest, deviation=lambda s: 0.03 * s.volts
            ),
        ),
    ),
    Effect(
        "supply_limit",
        physics="|u| ≤ U_s",
        source="section 6.2; the machine file's limit is the null value",
        parameters=(
            EffectParameter(
                "voltage",
                at.SUPPLY,
                "V",
                null=lambda s: s.supply,
                low=lambda s: 0.02 * s.volts,
                high=lambda s: s.supply,
                deviation=lambda s: 0.25 * s.volts,
            ),
        ),
    ),
)
"""Effects of the motor and amplifier families."""
