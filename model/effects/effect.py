"""Types of an effect and its parameters, and the joint sizes from which bounds and expected deviations are computed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from daq.contracts.effects import EffectName, effect_names
from daq.contracts.frozen import FrozenRecord
from model import layout as at


@dataclass(frozen=True)
class JointScale:
    """Typical sizes of a joint, so that the same effect suits every machine.

    Args:
        torque: largest torque (N·m, or N) of the drive at standstill.
        volts: largest voltage at the motor.
        strongest, highest: bounds of torque (N·m, N) and of drive. For a motor they equal `torque` and `volts`. For a
            plain gain they are infinite, because its machine file states no largest drive.
        speed: speed without load at `volts`, rad/s (m/s); 1 where the drive has no back-EMF.
        fastest: bound of speed: equals `speed`, or infinite where the drive has no back-EMF.
        resolution: one count of its sensor, rad (m); a 4096th of a turn where it has none.
        range: of its sensor, rad (m); one turn where it has none.
        gear: motor turns per joint turn. viscous: motor-side damping from the machine file, N·m·s/rad.
        inertia: of rotor and link in series, as a flexible transmission between them feels it, kg·m² (kg).
        period: control period, s. length, mass: of its link. supply: the supply's limit, V.
        resistance: of the winding, Ω.
    """

    torque: float
    volts: float
    strongest: float
    highest: float
    speed: float
    fastest: float
    resolution: float
    range: float
    viscous: float
    inertia: float
    period: float
    length: float
    mass: float
    supply: float
    gear: float
    resistance: float


Size = float | Callable[[JointScale], float]


def evaluate_size(size: Size, scale: JointScale) -> float:
    """Returns the value of a size, which is a number or a function of the joint."""
    return size(scale) if callable(size) else size


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Args:
        name: last part of the parameter's full name.
        column: its index in `model.layout`: a column of the joint, or a shared slot for an effect of the whole machine.
        unit: in SI.
        null: value at which the effect is absent; None for a parameter that only shapes it.
        start: value in a model to which the effect is added without a value; by default the null value.
        low, high: bounds. deviation: expected size on a machine that has the effect.
        source: where its numbers come from; if empty, the effect's own source.
    """

    name: str
    column: int
    unit: str
    null: Size | None = 0.0
    start: Size | None = None
    low: Size = -math.inf
    high: Size = math.inf
    deviation: Size = 1.0
    source: str = ""

    def starting_value(self, scale: JointScale) -> float:
        """Returns the value of the parameter in a model to which the effect has just been added."""
        chosen = self.null if self.start is None else self.start
        if chosen is None:
            raise ValueError(f"effect parameter {self.name} has neither a null nor a starting value")
        return evaluate_size(chosen, scale)


def torque_parameter(name: str, column: int, *, only_against: bool = False) -> EffectParameter:
    """Returns a torque of up to the drive's strongest, in both directions or `only_against` the motion. On a machine
    that has it, 2 % of the rated torque are expected."""
    return EffectParameter(
        name,
        column,
        "N·m",
        low=0.0 if only_against else lambda s: -s.strongest,
        high=lambda s: s.strongest,
        deviation=lambda s: 0.02 * s.torque,
    )


class Tone(StrEnum):
    """Whether a sinusoidal torque repeats over position or time; the value is the name of its rate parameter."""

    OVER_POSITION = "cycles"
    OVER_TIME = "frequency"


class EffectFile(FrozenRecord):
    """The file that defines a user's effect: its name, and the first digits of its SHA-256."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Effect:
    """A physical effect of the library.

    Args:
        name: the field's term, one of `daq.contracts.effects.toml`.
        physics: one line with the equation, in the symbols of the parameters.
        source: equation of the thesis, or the literature.
        parameters: what it adds to a model.
        flag: bit that switches on the state it needs (0: it only adds a term).
        whole_machine: it belongs to the machine, not to a joint.
        group: first part of its parameters' names when it belongs to the whole machine.
        joints: on which it may act; empty for any.
        tone: the variable over which it repeats, if it is a tone. Trial values of its parameters cannot find a tone; a
            spectrum proposes its rate.
        family, torque, file: only for a user's own effect (`model.effects.own`).
        own_entry: for an effect that is not in the shared list, its entry in that form (`machine_numbers`).
    """

    name: str
    physics: str
    source: str
    parameters: tuple[EffectParameter, ...]
    flag: int = 0
    whole_machine: bool = False
    group: str = "base"
    joints: tuple[int, ...] = ()
    tone: Tone | None = None
    family: str = ""
    torque: Callable[..., Any] | None = None
    file: EffectFile | None = None
    own_entry: EffectName | None = None

    @property
    def is_flexible(self) -> bool:
        """Whether rotor and link move relative to each other, which requires short integration steps."""
        return self.flag == at.HAS_FLEXIBILITY

    @property
    def shared_name(self) -> EffectName:
        """Returns its entry in the shared list; for a user's own effect, an entry of the same form."""
        if self.file is not None:
            return EffectName(self.name, "joint torque", self.family, self.physics)
        if self.own_entry is not None:
            return self.own_entry
        return effect_names()[self.name]
