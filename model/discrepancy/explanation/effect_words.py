"""The words for each effect: its name in a sentence, its size, and what it looks like in torques."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from daq.contracts.effects import FORMER_EFFECTS, effect_names
from model.discrepancy.diagnosis import FoundValue
from model.effects.library import find_named_effect
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_name


@dataclass(frozen=True)
class EffectWords:
    """What an effect is called, and which part of it is its size, if one is."""

    called: str
    size: str | None


WORDS: dict[str, EffectWords] = {
    "viscous_friction": EffectWords("viscous friction", "coefficient"),
    "coulomb_friction": EffectWords("Coulomb friction", "torque"),
    "load_dependent_friction": EffectWords("load-dependent friction", "arm"),
    "gravity_torque_friction": EffectWords("friction in proportion to the gravity torque", "share"),
    "stribeck_friction": EffectWords("Stribeck friction", "torque"),
    "stiction": EffectWords("stiction", "breakaway"),
    "direction_dependent_friction": EffectWords("friction that depends on the direction", "difference"),
    "direction_dependent_viscous_friction": EffectWords("viscous friction that depends on the direction", "difference"),
    "weakened_magnet": EffectWords("a motor whose magnet has weakened", "loss"),
    "resistance_drift": EffectWords("a winding that warms", "heating"),
    "resistance_rise": EffectWords("a winding whose resistance rises with time", "rise"),
    "motor_inductance": EffectWords("motor inductance", "inductance"),
    "dead_zone": EffectWords("a dead zone of the amplifier", "width"),
    "amplifier_threshold": EffectWords("an amplifier that passes nothing below a threshold", "width"),
    "supply_limit": EffectWords("a supply limit below the nominal one", "voltage"),
    "torque_ripple": EffectWords("torque ripple", None),
    "gear_loss": EffectWords("a loss in the gear", "loss"),
    "direction_dependent_gear_loss": EffectWords(
        "a loss in the gear that depends on whether the motor drives", "difference"
    ),
    "backlash": EffectWords("backlash", "gap"),
    "joint_compliance": EffectWords("a compliant joint", "compliance"),
    "payload": EffectWords("a load other than the model's", "mass"),
    "link_mass": EffectWords("a link of another mass", "added"),
    "centre_of_mass": EffectWords("a centre of mass elsewhere", "shift"),
    "base_tilt": EffectWords("a base that is not level", None),
    "spring_torque": EffectWords("a spring or cable that pulls", "stiffness"),
    "one_sided_spring": EffectWords("a cable or stop that pulls on one side only", "stiffness"),
    "periodic_disturbance": EffectWords("a periodic torque from outside", None),
    "potentiometer_gain": EffectWords("a wrong scale of the potentiometer", "relative"),
    "potentiometer_offset": EffectWords("a shifted potentiometer", "offset"),
    "potentiometer_nonlinearity": EffectWords("a potentiometer that bends", None),
    "input_delay": EffectWords("a delay of the drive", "time"),
    "wrong_gain": EffectWords("a controller gain other than assumed", "relative"),
    "lost_set_points": EffectWords("lost set points", "share"),
}
"""Every effect of the shared list."""

NUMBER_WORDS = {
    "wrong_rotor_inertia": EffectWords("a rotor inertia other than stated", None),
    "wrong_link_inertia": EffectWords("moments of inertia other than stated", None),
    "wrong_link_centre": EffectWords("a centre of mass other than stated", None),
    "wrong_geometry": EffectWords("dimensions other than stated", None),
    "wrong_torque_constant": EffectWords("a torque constant other than stated", None),
    "wrong_resistance": EffectWords("a resistance of the winding other than stated", None),
    "wrong_drive_gain": EffectWords("a gain of the drive other than stated", None),
    "wrong_gear_ratio": EffectWords("a gear ratio other than stated", None),
}
"""Every number of the machine that a step may name; each of its parameters is a size."""

IN_TORQUES = {
    "wrong_rotor_inertia": "{torque} is missing in proportion to the acceleration of this joint alone",
    "wrong_link_inertia": "{torque}s are missing as with the same mass spread differently over this link",
    "wrong_link_centre": "{torque}s are missing as with mass elsewhere in this link",
    "wrong_geometry": "{torque}s are missing as with a link of other dimensions",
    "wrong_torque_constant": "the drive gives another {torque} for the same volts, and brakes otherwise with speed",
    "wrong_resistance": "the drive gives another {torque} for the same volts, and brakes otherwise with speed",
    "wrong_drive_gain": "every {torque} of the drive is larger or smaller by the same share",
    "wrong_gear_ratio": "the drive gives another {torque} and turns otherwise for the same motion",
    "viscous_friction": "a {torque} against the motion grows in proportion to speed",
    "coulomb_friction": "a constant {torque} opposes motion and changes sign with its direction, at any speed",
    "load_dependent_friction": "a {torque} opposes motion in proportion to the weight on the joint",
    "gravity_torque_friction": "a {torque} opposes motion in proportion to the {torque} that gravity asks of the joint",
    "stribeck_friction": "a {torque} against slow motion fades as the joint gets faster",
    "stiction": "more {torque} is needed to set the joint in motion than to keep it moving",
    "direction_dependent_friction": "motion one way takes more {torque} than the other way",
    "direction_dependent_viscous_friction": "a {torque} against the motion grows in proportion to speed, one way only",
    "weakened_magnet": "the drive gives less {torque} for the same volts, and brakes less with speed",
    "resistance_drift": "the drive gives less {torque} the longer and harder it has worked",
    "resistance_rise": "the drive gives less {torque} the longer the record runs, however hard it has worked",
    "motor_inductance": "{torque} follows the drive with a lag that dies out exponentially",
    "dead_zone": "a constant part of the drive has no effect, whether the drive is large or small",
    "amplifier_threshold": "a small drive has no effect, and a large one all of its effect",
    "supply_limit": "above a certain drive the {torque} does not rise any more",
    "torque_ripple": "the {torque} goes up and down with the {angle}, at a fixed number of cycles a {turn}",
    "gear_loss": "a share of the driving {torque} is missing whenever the motor drives, and comes back when it brakes",
    "direction_dependent_gear_loss": "a share of the {torque} is missing only while the motor drives, or only while "
    "it is driven",
    "backlash": "{torque} is missing or in excess each time the load on the gear changes sides",
    "joint_compliance": "{torque} is missing in proportion to how its own rate changes: the rotor winds up a spring",
    "payload": "{torque}s are missing as with a mass at the end of the arm, on all joints that carry it",
    "link_mass": "{torque}s are missing as with mass spread along this link",
    "centre_of_mass": "{torque}s are missing as with mass further out along this link",
    "base_tilt": "{torque}s are missing as with gravity from another direction",
    "spring_torque": "a {torque} grows with the {angle} from a rest position",
    "one_sided_spring": "a {torque} grows with the {angle} beyond a rest position, and there is none before it",
    "periodic_disturbance": "a {torque} repeats at a fixed frequency whatever the joint does",
    "potentiometer_gain": "{torque}s fit when all {angle}s are read on another scale",
    "potentiometer_offset": "{torque}s fit when all {angle}s are shifted",
    "potentiometer_nonlinearity": "{torque}s fit when the {angle}'s reading is bent over its range",
    "input_delay": "{torque} follows the drive with a constant delay",
}
"""What each effect looks like in a balance of torques, with the words of `TURNING` or `SLIDING`."""
TURNING = {"torque": "torque", "angle": "angle", "turn": "turn"}
SLIDING = {"torque": "force", "angle": "position", "turn": "metre"}
"""Words for joints that turn, and for joints that slide."""


def words_of(effect: str) -> EffectWords:
    """The entry of an effect; of the user's own effects, its identifier in words."""
    if effect in WORDS:
        return WORDS[effect]
    if effect in MACHINE_NUMBERS:
        return NUMBER_WORDS[effect]
    called = effect_name(effect)
    shared = effect in effect_names() or effect in FORMER_EFFECTS
    return EffectWords(called if shared else f"{called} (an effect of the user's own)", None)


def size_of(effect: str, parameters: Mapping[str, FoundValue], joint: int = 0) -> FoundValue | None:
    """The parameter that is the size of an effect: that of a joint, where several have one."""
    sizes = [v for v in parameters.values() if v.part == words_of(effect).size]
    own = [v for v in sizes if joint in v.joints] or sizes
    return own[0] if own else None


def shape_in_torques(effect: str, *, slides: bool) -> str:
    """What an effect looks like in a balance of torques; of the user's own effects, the equation."""
    if effect in IN_TORQUES:
        return IN_TORQUES[effect].format(**(SLIDING if slides else TURNING))
    known = effect_names()
    return known[effect].line if effect in known else find_named_effect(effect).physics
