"""How large a hidden effect may be: from what careful work just sees to what nobody overlooks.

The ranges are for the arm of the data files at gains 2, 0, 0 and were chosen with `separation` on the 55 s reference
set (docs/mock.md tells how); at their upper ends the loop is still stable. A size is drawn evenly on a logarithmic
scale. It is the distance from the effect's null value: a factor of 1 ± size, a mass of ± size.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from math import pi
from random import Random

from mock_controller.modifications.registry import fields_of, known_modifications

Range = tuple[float, float]


@dataclass(frozen=True)
class SizeRange:
    """Sizes of one effect: those of joints 1 to 3, or a single range where it acts on no joint in particular.

    `signed` effects are drawn with either sign. `also` gives the ranges of further parameters, drawn evenly; a range
    of whole numbers gives a whole number.
    """

    effect: str
    parameter: str
    ranges: tuple[Range, ...]
    signed: bool = False
    also: dict[str, Range] = dataclasses.field(default_factory=dict)
    per_joint: dict[str, tuple[float, float, float]] = dataclasses.field(default_factory=dict)
    joints: tuple[int, ...] = (1, 2, 3)

    @property
    def acts_on_joints(self) -> bool:
        """Whether it is an effect of a joint (or of a link of that number)."""
        return len(self.ranges) > 1


def draw_values(random: Random, size: SizeRange, joint: int | None, strength: float, sign: int) -> dict[str, float]:
    """Parameters of an effect at `joint`, its size at `strength` (0 to 1) of the range there."""
    low, high = size.ranges[0 if joint is None else joint - 1]
    amount = low * (high / low) ** strength
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
    SizeRange("viscous_friction", "coefficient", ((10, 40), (20, 80), (4, 16))),
    SizeRange("coulomb_friction", "torque", ((2, 8), (4, 16), (1, 4))),
    SizeRange("load_dependent_friction", "arm", ((0.2, 0.8), (0.2, 0.8), (0.2, 0.8))),
    SizeRange("stribeck_friction", "torque", ((2, 8), (4, 16), (1, 4)), also={"speed": (0.05, 0.3)}),
    SizeRange("stiction", "breakaway", ((2, 8), (4, 16), (1, 4)), also={"speed": (0.01, 0.04)}),
    SizeRange("direction_dependent_friction", "torque", ((2, 8), (4, 16), (1, 4)), signed=True),
    SizeRange("back_emf_error", "factor", _alike(0.2, 0.6), signed=True),
    SizeRange("resistance_drift", "thermal_resistance", _alike(10, 100), also={"time_constant": (8.0, 30.0)}),
    SizeRange("motor_inductance", "inductance", _alike(0.01, 0.05)),
    SizeRange("dead_zone", "width", _alike(0.7, 4)),
    SizeRange("supply_limit", "reduction", _alike(6, 18)),
    SizeRange("torque_ripple", "amplitude", ((2, 8), (4, 16), (1, 4)), also={"periods": (12, 60), "phase": _TURN}),
    SizeRange("gear_loss", "loss", _alike(0.1, 0.4)),
    SizeRange(
        "backlash",
        "play",
        _alike(0.005, 0.03),
        per_joint={"stiffness": (2e4, 2e4, 4e3), "damping": (10.0, 10.0, 1.0)},
    ),
    SizeRange(
        "joint_compliance",
        "compliance",
        ((5e-4, 3e-3), (3e-4, 2e-3), (1e-3, 5e-3)),
        per_joint={"damping": (2.0, 2.0, 0.5)},
    ),
    SizeRange("payload", "mass", ((0.2, 0.8),), also={"offset": (0.0, 0.08)}),
    SizeRange("link_mass", "mass", ((1, 4), (0.2, 1.2), (0.2, 0.8)), joints=(2, 3)),
    SizeRange("centre_of_mass", "shift", _alike(0.03, 0.1), signed=True, joints=(2, 3)),
    SizeRange("base_tilt", "about_y", ((0.03, 0.15),), signed=True, also={"about_x": (-0.05, 0.05)}),
    SizeRange("spring_torque", "stiffness", ((2, 10), (4, 20), (1, 6)), per_joint={"neutral": (3.14, 0.79, 0.0)}),
    SizeRange(
        "periodic_disturbance",
        "amplitude",
        ((1, 8), (2, 16), (0.6, 4)),
        also={"frequency": (0.5, 6.0), "phase": _TURN},
    ),
    SizeRange("potentiometer_gain", "error", _alike(0.02, 0.1), signed=True),
    SizeRange("potentiometer_offset", "angle", _alike(0.02, 0.1), signed=True),
    SizeRange("potentiometer_nonlinearity", "loading", _alike(0.05, 0.3), signed=True),
    SizeRange("input_delay", "delay", ((0.004, 0.02), (0.004, 0.06), (0.002, 0.01))),
    SizeRange("wrong_gain", "factor", _alike(0.1, 0.4), signed=True),
    SizeRange("lost_set_points", "share", _alike(0.05, 0.5), also={"seed": (0, 2**31)}),
)
"""Sizes of the effects whose names are shared."""

OPEN_SIZES: tuple[SizeRange, ...] = (
    SizeRange(
        "tight_spot",
        "coefficient",
        ((10, 40), (30, 90), (4, 16)),
        also={"width": (0.05, 0.2)},
        per_joint={"centre": (3.35, 1.0, 0.2)},
    ),
    SizeRange("quadratic_drag", "coefficient", ((15, 60), (30, 120), (5, 25))),
    SizeRange("cable_hysteresis", "torque", ((2, 8), (4, 16), (1, 4)), also={"reach": (0.05, 0.3)}),
    SizeRange("ageing_friction", "torque", ((1, 4), (2, 8), (0.5, 2)), also={"onset": (0.05, 0.5)}),
    SizeRange("detent_cogging", "amplitude", ((2, 8), (4, 16), (1, 4)), also={"periods": (10, 40)}),
    SizeRange("amplifier_slew_rate", "time_per_volt", _alike(0.001, 0.005)),
    SizeRange("drive_coupling", "share", _alike(0.05, 0.3), signed=True, per_joint={"onto": (2, 3, 1)}),
    SizeRange(
        "potentiometer_zero_drift", "drift", _alike(0.01, 0.06), signed=True, also={"time_constant": (8.0, 30.0)}
    ),
    SizeRange("converter_bit_weight", "error", _alike(4, 30), signed=True, also={"bit": (5, 8)}),
    SizeRange("stuck_converter_bit", "bit", _alike(4, 6)),
)
"""Sizes of the effects that only the mock knows."""
