"""Checks whether the intervals of an answer cover the truth of a rig, for sizes that both sides define alike.

A size counts if the rig's law is the library's own: a hardening spring, for example, has no single stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Json = dict[str, Any]


@dataclass(frozen=True)
class _Size:
    """A parameter of the library, and its value on the rig's side: from the joint's parameters and the drawn sizes.

    laws: those in which the rig has the library's law; None for all.
    """

    part: str
    true: Callable[[Json, Json], float]
    laws: tuple[int, ...] | None = None


def _drawn(name: str) -> Callable[[Json, Json], float]:
    return lambda _, sizes: float(sizes[name])


def _of_joint(name: str) -> Callable[[Json, Json], float]:
    return lambda joint, _: float(joint[name])


SIZES: dict[str, tuple[_Size, ...]] = {
    "coulomb_friction": (_Size("torque", _of_joint("coulomb")),),
    "stribeck_friction": (
        _Size("torque", _drawn("stribeck"), (0,)),
        _Size("speed", _drawn("stribeck_speed"), (0,)),
    ),
    "direction_dependent_friction": (_Size("difference", _drawn("direction")),),
    "gear_loss": (_Size("loss", _drawn("gear_loss"), (0,)),),
    "weakened_magnet": (_Size("loss", _drawn("weaker")),),
    "motor_inductance": (_Size("inductance", _of_joint("inductance")),),
    "resistance_drift": (_Size("heating", _of_joint("heating"), (0, 1)),),
    "dead_zone": (_Size("width", _drawn("dead_zone"), (0,)),),
    "amplifier_threshold": (_Size("width", _drawn("dead_zone"), (1,)),),
    "supply_limit": (_Size("voltage", _drawn("supply")),),
    "joint_compliance": (_Size("compliance", lambda joint, _: 1.0 / float(joint["stiffness"]), (0, 2)),),
    "backlash": (_Size("gap", _drawn("gap"), (0,)),),
    "payload": (_Size("mass", _drawn("load")),),
    "link_mass": (_Size("added", _drawn("mass")),),
    "centre_of_mass": (_Size("shift", _drawn("shift")),),
    "spring_torque": (_Size("stiffness", _drawn("spring"), (0,)), _Size("rest", _drawn("spring_rest"), (0,))),
    "torque_ripple": (_Size("cycles", _drawn("ripple_cycles"), (0,)),),
    "periodic_disturbance": (_Size("frequency", _drawn("disturbance_frequency"), (0,)),),
    "potentiometer_gain": (_Size("relative", _drawn("sensor_gain")),),
    "potentiometer_offset": (_Size("offset", _drawn("sensor_offset")),),
    "wrong_gain": (_Size("relative", _drawn("gain_error")),),
    "lost_set_points": (_Size("share", _drawn("lost")),),
}
"""Sizes of each effect that can be compared, by the library's name."""


def covered(truth: Json, answer: Json | None) -> list[bool]:
    """Returns whether each interval of a single effect covers the true size, if it was named at its joint, alone or in
    a group."""
    if truth["case"] != "single" or answer is None:
        return []
    hidden = truth["hidden"][0]
    joints = [] if hidden["joint"] is None else [hidden["joint"]]
    joint = truth["joints"][(hidden["joint"] or 1) - 1]
    found = []
    for step in answer["steps"]:
        if not step["adopted"] or step["effect"] != hidden["known_as"] or step["joints"] != joints:
            continue
        for size in SIZES.get(step["effect"], ()):
            if size.laws is not None and hidden["law"] not in size.laws:
                continue
            own = [value for value in step["parameters"].values() if value["part"] == size.part]
            found += [
                value["low"] <= size.true(joint, hidden["sizes"]) <= value["high"]
                for value in own
                if value["low"] is not None and value["high"] is not None
            ]
    return found
