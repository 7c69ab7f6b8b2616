"""Quantities in which two healthy arms may differ, and by how much.

A deviation is a fraction of the data file's value; that of the computing delay is in seconds. Each potentiometer
deviates by a smooth curve; for a refit it is represented by three harmonics (`LinearityHarmonic`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from math import cos, pi, sin
from random import Random
from typing import ClassVar

from firmware_protocol.units import ADC_COUNTS
from mock_controller.board.parameters import BoardParameters
from mock_controller.modifications.parameter import change_body, change_joint
from mock_controller.plant.parameters import PlantParameters
from mock_controller.quantities import QuantityReader

_MODELLED = (1, 2, 3)
_MASSES = ("m1", "m2", "m3", "m_load")
_LENGTHS = ("r1", "a2", "a3")
_JOINT_CONSTANTS = ("resistance", "torque_constant", "back_emf_constant", "rotor_inertia", "viscous_friction")
_DYNAMIC = ("m2", "m3", "torque_constant", "rotor_inertia")
_MOST = 2.0
"""Truncation of drawn deviations, in standard deviations."""
_STEP_S = 1e-3
"""Resolution (s) of the board's computing delay: a whole number of the plant's steps."""
HARMONICS = (1, 2, 3)


@dataclass(frozen=True)
class Tolerance:
    """One quantity that may deviate; standard deviations as stated to others, and as drawn, in its unit.

    `is_time`: they are in s, not fractions of the value. `dynamic`: a mass, torque constant or rotor inertia that shows
    in every motion.
    """

    name: str
    stated: float
    drawn: float
    is_time: bool = field(default=False, repr=False)
    dynamic: bool = field(default=False, repr=False)


@cache
def tolerances() -> tuple[Tolerance, ...]:
    """Returns every quantity of the arm that may deviate: `m1` … `a3`, `resistance_1` … `coulomb_arm_3`,
    `computing_delay`."""
    text = resources.files("mock_controller.hidden").joinpath("tolerances.toml").read_text("utf-8")
    reader = QuantityReader(text, "tolerances.toml")

    def of_table(table: str, unit: str = "1") -> tuple[float, float]:
        stated, drawn = (reader.take(table, key, unit, 0, 1) for key in ("stated", "drawn"))
        return stated, drawn

    mass, length = of_table("mass"), of_table("length")
    found = [Tolerance(name, *mass, dynamic=name in _DYNAMIC) for name in _MASSES] + [
        Tolerance(name, *length) for name in _LENGTHS
    ]
    for table in (*_JOINT_CONSTANTS, "coulomb_arm"):
        found += [Tolerance(f"{table}_{joint}", *of_table(table), dynamic=table in _DYNAMIC) for joint in _MODELLED]
    found.append(Tolerance("computing_delay", *of_table("computing_delay", "s"), is_time=True))
    reader.finish()
    return tuple(found)


def draw_deviations(random: Random, scale: float = 1.0) -> dict[str, float]:
    """Draws deviations of a healthy arm, normal within two standard deviations, times `scale`."""
    return {tolerance.name: scale * tolerance.drawn * _within(random) for tolerance in tolerances()}


def _within(random: Random) -> float:
    while True:
        value = random.gauss(0.0, 1.0)
        if abs(value) <= _MOST:
            return value


def deviating_plant(parameters: PlantParameters, deviations: Mapping[str, float]) -> PlantParameters:
    """Returns the arm with its deviations; zero deviations give exactly the same numbers."""
    body = parameters.rigid_body
    changed = {name: getattr(body, name) * (1.0 + deviations.get(name, 0.0)) for name in (*_MASSES, *_LENGTHS)}
    parameters = change_body(parameters, **changed)
    for joint in _MODELLED:
        present = parameters.joints[joint - 1]
        factors = {key: 1.0 + deviations.get(f"{key}_{joint}", 0.0) for key in _JOINT_CONSTANTS}
        values = {key: getattr(present, key) * factor for key, factor in factors.items()}
        parameters = change_joint(parameters, joint, **values)
    friction = parameters.friction
    more = [friction.effective_arm * deviations.get(f"coulomb_arm_{joint}", 0.0) for joint in _MODELLED]
    one, two, three = (arm + extra for arm, extra in zip(friction.extra_arms, more, strict=True))
    return replace(parameters, friction=replace(friction, extra_arms=(one, two, three)))


def deviating_board(parameters: BoardParameters, deviations: Mapping[str, float]) -> BoardParameters:
    """Returns the board with its deviations: the computing delay, to the nearest ms."""
    steps = round(deviations.get("computing_delay", 0.0) / _STEP_S)
    timing = parameters.timing
    late = timing.computing_delay + steps * round(_STEP_S * 1e6)
    return replace(parameters, timing=replace(timing, computing_delay=max(late, 0)))


@dataclass
class LinearityHarmonic:
    """A part of a potentiometer's curve: `counts` times sine and cosine shares of a harmonic of its range."""

    name: ClassVar[str] = "linearity_harmonic"
    joint: int
    harmonic: int
    sine: float
    cosine: float

    def reading(self, counts: float) -> float:
        turn = 2.0 * pi * self.harmonic * counts / ADC_COUNTS
        return counts + self.sine * sin(turn) + self.cosine * cos(turn)


def harmonic_deviation(linearity: float, harmonic: int) -> float:
    """Returns the standard deviation (counts) of one share of a harmonic of curves within `linearity` (fraction of the
    range).

    Curves have three harmonics of random phase and size falling with their order, and are scaled to 40 to 100 % of the
    limit at their largest; the numbers are those of 4000 such curves.
    """
    return linearity * ADC_COUNTS * {1: 0.33, 2: 0.17, 3: 0.12}[harmonic]
