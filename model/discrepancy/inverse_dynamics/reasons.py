"""Why an effect was named, in one line that an engineer can check against the plots."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from daq.contracts.effects import effect_names
from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.explanation.numbers import plain
from model.effects.library import effect

SHAPES = {
    "viscous_friction": "a torque against the motion grows in proportion to speed",
    "coulomb_friction": "a constant torque opposes motion and changes sign with its direction, at any speed",
    "load_dependent_friction": "a torque opposes motion in proportion to the weight on the joint",
    "stribeck_friction": "a torque against slow motion fades as the joint gets faster",
    "stiction": "more torque is needed to set the joint in motion than to keep it moving",
    "direction_dependent_friction": "motion one way takes more torque than the other way",
    "back_emf_error": "the drive lacks torque in proportion to speed, as a larger back-EMF makes it",
    "resistance_drift": "the drive gives less torque the longer and harder it has worked",
    "motor_inductance": "torque follows the drive with a lag that dies out exponentially",
    "dead_zone": "a part of the drive of its own sign does nothing, large or small",
    "supply_limit": "beyond a certain drive no more torque comes",
    "torque_ripple": "the torque goes up and down with the angle, at a fixed number of cycles a turn",
    "gear_loss": "a share of the driving torque is missing whenever the motor drives, and comes back when it brakes",
    "backlash": "torque is missing or in excess each time the load on the gear changes sides",
    "joint_compliance": "torque is missing in proportion to how its own rate changes: the rotor winds up a spring",
    "payload": "torques are missing as a mass at the end of the arm makes them, on all joints that carry it",
    "link_mass": "torques are missing as mass spread along this link makes them",
    "centre_of_mass": "torques are missing as mass further out along this link makes them",
    "base_tilt": "torques are missing as gravity from another direction makes them",
    "spring_torque": "a torque grows with the angle from a rest position",
    "periodic_disturbance": "a torque repeats at a fixed frequency whatever the joint does",
    "potentiometer_gain": "torques fit when all angles are read on another scale",
    "potentiometer_offset": "torques fit when all angles are shifted",
    "potentiometer_nonlinearity": "torques fit when the angle's reading is bent over its range",
    "input_delay": "torque follows the drive later, by the same time throughout",
}
"""What each effect looks like in residual torques."""


SLIDING = {
    "torques": "forces",
    "torque": "force",
    "angles": "positions",
    "angle": "position",
    "a turn": "a metre",
}
"""The same words for a joint that slides."""


def reason(
    name: str, joints: tuple[int, ...], values: Mapping[str, FoundValue], removed: float, *, slides: bool = False
) -> str:
    """One line: what is seen, the size, and how much of the held-out residual it explains. `slides`: whether the joints
    do."""
    where = "" if not joints else ("joint " if len(joints) == 1 else "joints ") + ", ".join(map(str, joints)) + ": "
    seen = SHAPES.get(name) or (effect_names()[name].line if name in effect_names() else effect(name).physics)
    for word, other in SLIDING.items() if slides else ():
        seen = seen.replace(word, other)
    sizes = _sizes(joints, values, slides=slides)
    return f"{where}{seen}{sizes}; it takes {removed:.0%} off the mean square on records not fitted to"


def with_sizes(
    text: str, joints: Sequence[int], before: Mapping[str, FoundValue], after: Mapping[str, FoundValue],
    *, slides: bool = False,
) -> str:  # fmt: skip
    """A reason that was given with the parameters `before`, with the numbers of `after`."""
    return text.replace(_sizes(joints, before, slides=slides), _sizes(joints, after, slides=slides), 1)


def _sizes(joints: Sequence[int], values: Mapping[str, FoundValue], *, slides: bool) -> str:
    """“ (torque 8.01 N)”."""
    return f" ({', '.join(_size(n, v, several=len(joints) > 1, slides=slides) for n, v in values.items())})"


def _size(name: str, value: FoundValue, *, several: bool, slides: bool) -> str:
    group, last = name.partition(".")[0], name.rpartition(".")[2]
    on = f" of {group}" if several and "joint" in group else ""
    unit = "" if value.unit == "1" else f" {value.unit}"
    if last == "cycles":  # rad of phase a rad (m): cycles a turn, or 2π times those a metre
        unit = f" rad/m, {plain(value.value / (2 * math.pi), 3)} a metre" if slides else " a turn"
    return f"{last}{on} {plain(value.value, 3)}{unit}"
