"""Sizes of hidden effects: from barely detectable to obvious.

The ranges are for the arm of the data files at gains 2, 0, 0 and were chosen with `separation` on the 55 s reference
set (docs/mock.md describes how); at their upper ends the loop is still stable. A size is drawn evenly on a logarithmic
scale. It is the distance from the effect's null value: a factor of 1 ± size, a mass of ± size.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from math import pi
from random import Random

from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import known_modifications

Range = tuple[float, float]


@dataclass(frozen=True)
class SizeRange:
    """Sizes of one effect: those of joints 1 to 3, or a single range if it acts on no joint in particular.

    `signed` effects are drawn with either sign, negative ones `negative` times as large. `also` gives the ranges of
    further parameters, drawn evenly (whole numbers if both ends are), `per_joint` those that depend on the joint.
    """

    effect: str
    parameter: str
    ranges: tuple[Range, ...]
    signed: bool = False
    negative: float = 1.0
    also: dict[str, Range] = dataclasses.field(default_factory=dict)
    per_joint: dict[str, tuple[float, float, float]] = dataclasses.field(default_factory=dict)
    joints: tuple[int, ...] = (1, 2, 3)

    @property
    def acts_on_joints(self) -> bool:
        """Whether it is an effect of a joint (or of a link of that number)."""
        return len(self.ranges) > 1


def draw_values(random: Random, size: SizeRange, joint: int | None, strength: float, sign: int) -> dict[str, float]:
    """Returns parameters of an effect at `joint`, with a size at `strength` (0 to 1) of the range there."""
    low, high = size.ranges[0 if joint is None else joint - 1]
    amount = low * (high / low) ** strength * (size.negative if sign < 0 else 1.0)
    field = fields_of(known_modifications()[size.effect])[size.parameter]
    values: dict[str, float] = {} if joint is None else {"joint": joint}
    values[size.parameter] = round(amount) if field.type == "int" else field.metadata["null"] + sign * amount
    for key, choices in size.per_joint.items():
        values[key] = choices[(joint or 1) - 1]
    for key, (least, most) in size.also.items():
        whole = isinstance(least, int) and isinstance(most, int)
        values[key] = random.randint(int(least), int(most)) if whole else random.uniform(least, most)
    return values


def _alike(low: float, high: float) -> tuple[Range, ...]:
    return ((low, high),) * 3


_TURN: Range = (0.0, 2.0 * pi)

SHARED_SIZES: tuple[SizeRange, ...] = (
    SizeRange("viscous_friction", "coefficient", ((12, 60), (30, 80), (5, 30))),
    SizeRange("coulomb_friction", "torque", ((0.3, 5), (0.7, 9), (0.15, 1.8))),
    SizeRange("load_dependent_friction", "arm", _alike(0.1, 0.8)),
    SizeRange("stribeck_friction", "torque", ((0.4, 5), (0.6, 10), (0.15, 2.5)), also={"speed": (0.05, 0.3)}),
    SizeRange("stiction", "breakaway", ((0.8, 12), (0.8, 16), (0.5, 6)), also={"speed": (0.01, 0.04)}),
    SizeRange("direction_dependent_friction", "torque", ((0.12, 3), (0.6, 12), (0.15, 3)), signed=True),
    SizeRange("weakened_magnet", "loss", _alike(0.1, 0.5)),
    SizeRange(
        "resistance_drift",
        "thermal_resistance",
        ((15, 250), (0.5, 12), (7, 120)),
        also={"time_constant": (8.0, 30.0)},
    ),
    SizeRange("motor_inductance", "inductance", ((0.005, 0.06), (0.012, 0.15), (0.005, 0.04))),
    SizeRange("dead_zone", "width", _alike(0.06, 2)),
    SizeRange("supply_limit", "reduction", ((4, 16), (2, 12), (10, 20))),
    SizeRange(
        "torque_ripple",
        "amplitude",
        ((0.06, 1.5), (0.12, 3), (0.035, 0.9)),
        also={"periods": (12, 60), "phase": _TURN},
    ),
    SizeRange("gear_loss", "loss", ((0.03, 0.45), (0.07, 0.5), (0.03, 0.4))),
    SizeRange(
        "backlash",
        "play",
        ((8e-4, 0.012), (1.5e-3, 0.03), (8e-4, 0.02)),
        per_joint={"stiffness": (2e4, 2e4, 2e3), "damping": (10.0, 10.0, 1.0)},
    ),
    SizeRange(
        "joint_compliance",
        "compliance",
        ((8e-5, 8e-4), (8e-5, 1.5e-3), (5e-4, 3e-3)),
        per_joint={"damping": (4.0, 4.0, 0.5)},
    ),
    SizeRange("payload", "mass", ((0.25, 1.2),), also={"offset": (0.0, 0.08)}),
    SizeRange("link_mass", "mass", ((0.5, 3), (0.3, 2.5), (0.25, 1.5)), joints=(2, 3)),
    SizeRange("centre_of_mass", "shift", ((0.05, 0.12), (0.05, 0.14), (0.04, 0.084)), signed=True, joints=(2, 3)),
    SizeRange("base_tilt", "about_y", ((0.01, 0.15),), signed=True, also={"about_x": (-0.01, 0.01)}),
    SizeRange(
        "spring_torque", "stiffness", ((0.12, 4), (0.6, 20), (0.16, 4)), per_joint={"neutral": (3.14, 0.79, 0.0)}
    ),
    SizeRange(
        "periodic_disturbance",
        "amplitude",
        ((0.07, 2), (0.16, 5), (0.04, 1.2)),
        also={"frequency": (0.5, 6.0), "phase": _TURN},
    ),
    SizeRange("potentiometer_gain", "error", _alike(0.03, 0.12), signed=True),
    SizeRange("potentiometer_offset", "angle", _alike(0.03, 0.15), signed=True, joints=(2, 3)),
    SizeRange("potentiometer_nonlinearity", "loading", _alike(0.08, 0.5), signed=True),
    SizeRange("input_delay", "delay", ((0.0015, 0.024), (0.003, 0.06), (0.0012, 0.012))),
    SizeRange("wrong_gain", "factor", ((0.03, 0.45), (0.02, 0.4), (0.05, 0.35)), signed=True),
    SizeRange("lost_set_points", "share", _alike(0.01, 0.4), also={"seed": (0, 2**31)}),
)
"""Sizes of the effects with shared names, except those of `LATER_SIZES`. Joints whose readings do not depend on the
effect are left out."""

LATER_SIZES: tuple[SizeRange, ...] = (
    SizeRange("gravity_torque_friction", "share", _alike(0.06, 0.6), joints=(2, 3)),
    SizeRange("direction_dependent_viscous_friction", "coefficient", ((12, 60), (30, 80), (5, 30)), signed=True),
    SizeRange("direction_dependent_gear_loss", "difference", ((0.03, 0.45), (0.07, 0.5), (0.03, 0.4)), signed=True),
    SizeRange("amplifier_threshold", "width", _alike(0.3, 2)),
    SizeRange("resistance_rise", "rise", ((0.06, 0.6), (0.02, 0.4), (0.04, 0.5)), also={"time_constant": (20.0, 60.0)}),
    SizeRange(
        "one_sided_spring",
        "stiffness",
        ((0.3, 8), (1, 30), (0.3, 8)),
        signed=True,
        per_joint={"slack": (3.2, 0.77, 0.0)},
    ),
    SizeRange("constant_torque", "torque", ((0.07, 2), (0.16, 5), (0.04, 1.2)), signed=True),
)
"""Sizes of effects with shared names that came after eight trials had been registered. They are a separate kind of arm,
so that every seed of those trials keeps its secret."""

OPEN_SIZES: tuple[SizeRange, ...] = (
    SizeRange(
        "tight_spot",
        "coefficient",
        ((1, 40), (3, 90), (0.5, 16)),
        also={"width": (0.05, 0.2)},
        per_joint={"centre": (3.35, 1.0, 0.2)},
    ),
    SizeRange("quadratic_drag", "coefficient", ((3, 60), (6, 80), (1, 25))),
    SizeRange("cable_hysteresis", "torque", ((0.2, 5), (0.5, 10), (0.1, 2.5)), also={"reach": (0.05, 0.3)}),
    SizeRange("ageing_friction", "torque", ((0.1, 3), (0.2, 6), (0.06, 1.5)), also={"onset": (0.05, 0.5)}),
    SizeRange("detent_cogging", "amplitude", ((0.06, 1.5), (0.12, 3), (0.035, 0.9)), also={"periods": (10, 40)}),
    SizeRange("amplifier_slew_rate", "time_per_volt", _alike(2e-4, 3e-3)),
    SizeRange(
        "drive_coupling", "share", ((0.01, 0.2), (0.01, 0.2), (0.01, 0.2)), signed=True, per_joint={"onto": (2, 3, 1)}
    ),
    SizeRange(
        "potentiometer_zero_drift", "drift", _alike(2e-3, 0.06), signed=True, also={"time_constant": (8.0, 30.0)}
    ),
    SizeRange("converter_bit_weight", "error", _alike(0.7, 8), signed=True, also={"bit": (5, 8)}),
    SizeRange("stuck_converter_bit", "bit", _alike(1, 4)),
)
"""Sizes of the effects that only the mock has, and of one that came to the library later and keeps its draws."""
