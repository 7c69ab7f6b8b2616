"""For each effect: how it is called, and what in a record speaks for it, in the order in which a person would look."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.effects import effect_names
from model.discrepancy.explanation import observations as o
from model.discrepancy.explanation.observations import Observe


@dataclass(frozen=True)
class Telling:
    """What an effect is called, the last name of the parameter that is its size, and what speaks for it."""

    called: str
    size: str | None
    observed: tuple[Observe, ...]


INERTIA = (o.goes_with_weight, o.late_at_changes, o.lags_with_speed)

TELLING: dict[str, Telling] = {
    "viscous_friction": Telling("viscous friction", "coefficient", (o.lags_with_speed,)),
    "coulomb_friction": Telling("Coulomb friction", "torque", (o.lags_alike,)),
    "load_dependent_friction": Telling("load-dependent friction", "arm", (o.lags_under_load, o.lags_alike)),
    "stribeck_friction": Telling("Stribeck friction", "torque", (o.lags_when_slow, o.lags_alike)),
    "stiction": Telling("stiction", "breakaway", (o.sticks, o.stops_short, o.lags_when_slow)),
    "direction_dependent_friction": Telling(
        "friction that depends on the direction", "difference", (o.lags_one_way,)
    ),
    "back_emf_error": Telling("a back-EMF constant off its data sheet", "relative", (o.lags_with_speed,)),
    "resistance_drift": Telling("a winding that warms", "heating", (o.grows_with_time, o.lags_under_drive)),
    "motor_inductance": Telling("motor inductance", "inductance", (o.late_at_changes,)),
    "dead_zone": Telling("a dead zone of the amplifier", "width", (o.lags_alike, o.stops_short, o.lags_when_slow)),
    "supply_limit": Telling("a supply limit below the nominal one", "voltage", (o.fails_at_high_drive,)),
    "torque_ripple": Telling("torque ripple", None, (o.swings_with_position,)),
    "gear_loss": Telling("a loss in the gear", "loss", (o.lags_under_drive, o.lags_alike)),
    "backlash": Telling("backlash", "gap", (o.lags_after_turns,)),
    "joint_compliance": Telling("a compliant joint", "compliance", (o.late_at_changes, o.goes_with_weight)),
    "payload": Telling("a load other than the model's", "mass", INERTIA),
    "link_mass": Telling("a link of another mass", "added", INERTIA),
    "centre_of_mass": Telling("a centre of mass elsewhere", "shift", INERTIA),
    "base_tilt": Telling("a base that is not level", None, (o.goes_with_weight, o.bends_with_position, o.stays_off)),
    "spring_torque": Telling("a spring or cable that pulls", "stiffness", (o.goes_with_position,)),
    "periodic_disturbance": Telling("a periodic torque from outside", None, (o.swings_with_time,)),
    "potentiometer_gain": Telling(
        "a wrong scale of the potentiometer", "relative", (o.goes_with_position, o.lags_with_speed, o.goes_with_weight)
    ),
    "potentiometer_offset": Telling(
        "a shifted potentiometer", "offset", (o.stays_off, o.goes_with_weight, o.bends_with_position)
    ),
    "potentiometer_nonlinearity": Telling("a potentiometer that bends", None, (o.bends_with_position,)),
    "input_delay": Telling("a delay of the drive", "time", (o.late_at_changes,)),
    "wrong_gain": Telling("a controller gain other than assumed", "relative", (o.drives_otherwise, o.lags_with_speed)),
    "lost_set_points": Telling("lost set points", "share", (o.jolts, o.late_at_changes)),
}  # fmt: skip
"""Every effect of the shared list."""

GENERAL: tuple[Observe, ...] = (
    o.lags_alike, o.lags_with_speed, o.lags_when_slow, o.lags_after_turns, o.lags_one_way, o.sticks, o.stops_short,
    o.fails_at_high_drive, o.late_at_changes, o.goes_with_weight, o.goes_with_position, o.bends_with_position,
    o.grows_with_time, o.lags_under_load, o.lags_under_drive, o.stays_off,
)  # fmt: skip
"""What can be seen of any disagreement."""


def telling(effect: str) -> Telling:
    """The entry of an effect; one of the user's own is told by whatever shows most."""
    if effect in TELLING:
        return TELLING[effect]
    called = effect.replace("_", " ")
    known = effect in effect_names()
    return Telling(called if known else f"{called} (an effect of the user's own)", None, GENERAL)
