"""An arm drawn from a seed: its load, its deviations, its hidden effects.

A seed is a whole number, 100·number + 10·kind + load. Its last digit gives the load, which is announced to those who
diagnose; the digit before it gives the kind of arm, which is not. All else is drawn from the whole number, so that arms
of different kinds have nothing in common.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from random import Random
from typing import Any

from mock_controller.board.parameters import BoardParameters
from mock_controller.hidden.experiment import LoopParts
from mock_controller.hidden.sizes import LATER_SIZES, OPEN_SIZES, SHARED_SIZES, SizeRange, draw_values
from mock_controller.hidden.tolerances import deviating_board, deviating_plant, draw_deviations, tolerances
from mock_controller.modifications import Modification, build_modifications
from mock_controller.modifications.parameter import change_body
from mock_controller.modifications.registry import is_shared
from mock_controller.plant import PlantParameters

SEED_LIMIT = 2**63
UNKNOWN = "unknown_effect"
"""Name of an effect that is not in the shared list."""
_WRONG_PRIORS = 2
"""Number of constants outside their stated tolerance, in arms of kind `WRONG_PRIORS`."""
_OUTSIDE = (3.0, 5.0)
"""Range of those deviations, in drawn standard deviations."""


class SecretError(ValueError):
    """A secret that cannot be drawn."""


class Kind(IntEnum):
    """Kinds of arms that seeds draw; under `ANY` the rest of the seed decides the kind."""

    ANY = 0
    CLEAN = 1
    SINGLE = 2
    OPEN_SET = 3
    PAIR = 4
    SHARED_BY_JOINTS = 5
    WRONG_PRIORS = 6
    LATER_SINGLE = 7


OF_ANY = tuple(kind for kind in Kind if Kind.ANY < kind <= Kind.WRONG_PRIORS)
"""Kinds that `ANY` draws. Later kinds, and later effects of the library, are not included, so that a seed keeps its
arm."""


class Load(IntEnum):
    """Loads that the arm may carry; the load is announced to everybody."""

    NOMINAL = 0
    LIGHT = 1
    HEAVY = 2


LOAD_KG: dict[Load, float | None] = {Load.NOMINAL: None, Load.LIGHT: 0.4, Load.HEAVY: 2.0}
"""Mass MLOAD (kg), wrist and hand included; None keeps that of the data file."""


@dataclass(frozen=True)
class HiddenEffect:
    """One effect at its joints (none: on the arm as a whole), with a set of parameters for each."""

    name: str
    joints: tuple[int, ...]
    parameters: tuple[dict[str, float], ...]
    strength: float

    @property
    def known_as(self) -> str:
        """Returns its name in the shared list, or UNKNOWN."""
        return self.name if is_shared(self.name) else UNKNOWN

    def modifications(self) -> tuple[Modification, ...]:
        """Returns the effect as modifications of the mock."""
        return build_modifications((self.name, values) for values in self.parameters)


@dataclass(frozen=True)
class HiddenArm:
    """All secrets of a seed. Deviations are fractions of the data file's values (delay: s)."""

    seed: int
    kind: Kind
    load: Load
    deviations: dict[str, float]
    effects: tuple[HiddenEffect, ...]

    def plant_parameters(self, parameters: PlantParameters) -> PlantParameters:
        """Returns the arm with its load and deviations, without its effects."""
        return deviating_plant(loaded(parameters, self.load), self.deviations)

    def board_parameters(self, parameters: BoardParameters) -> BoardParameters:
        """Returns the board with its deviations."""
        return deviating_board(parameters, self.deviations)

    def modifications(self, leave_out: int | None = None) -> tuple[Modification, ...]:
        """Returns the effects as modifications of the mock; without that of index `leave_out`."""
        kept = (effect for index, effect in enumerate(self.effects) if index != leave_out)
        return tuple(modification for effect in kept for modification in effect.modifications())

    def parts(self, plant: PlantParameters, board: BoardParameters) -> LoopParts:
        """Returns the complete arm, for a loop without rounding."""
        return LoopParts(self.plant_parameters(plant), self.board_parameters(board), self.modifications(), self.seed)

    def truth(self) -> dict[str, Any]:
        """Returns all secrets, as JSON data."""
        return {
            "seed": self.seed,
            "kind": self.kind.name.lower(),
            "load": self.load.name.lower(),
            "load_kg": LOAD_KG[self.load],
            "effects": [
                {
                    "effect": effect.name,
                    "known_as": effect.known_as,
                    "joints": list(effect.joints),
                    "parameters": [dict(values) for values in effect.parameters],
                    "strength": effect.strength,
                }
                for effect in self.effects
            ],
            "deviations": dict(self.deviations),
        }


def loaded(parameters: PlantParameters, load: Load) -> PlantParameters:
    """Returns the arm with one of the announced loads."""
    mass = LOAD_KG[load]
    return parameters if mass is None else change_body(parameters, m_load=mass)


def compose_seed(number: int, kind: Kind, load: Load) -> int:
    """Returns the seed of arm `number` of a kind and a load."""
    return 100 * number + 10 * kind + load


def draw_arm(seed: int) -> HiddenArm:
    """Returns the arm of a seed. Raises SecretError for an invalid seed."""
    kind_digit, load_digit = seed // 10 % 10, seed % 10
    if not 0 <= seed < SEED_LIMIT or kind_digit > max(Kind) or load_digit > max(Load):
        raise SecretError(
            f"secret {seed}: must be 100·number + 10·kind + load from 0 on, kinds 0 to {max(Kind):d}, "
            f"loads 0 to {max(Load):d}"
        )
    random = Random(f"hidden arm {seed}")
    kind, load = Kind(kind_digit), Load(load_digit)
    if kind is Kind.ANY:
        kind = random.choice(OF_ANY)
    deviations = draw_deviations(random)
    if kind is Kind.WRONG_PRIORS:
        _put_outside(random, deviations)
    return HiddenArm(seed, kind, load, deviations, _effects(random, kind))


def _put_outside(random: Random, deviations: dict[str, float]) -> None:
    """Moves some constants outside their stated tolerance."""
    candidates = [tolerance for tolerance in tolerances() if tolerance.dynamic]
    for tolerance in random.sample(candidates, _WRONG_PRIORS):
        deviations[tolerance.name] = random.choice((-1, 1)) * random.uniform(*_OUTSIDE) * tolerance.drawn


def _effects(random: Random, kind: Kind) -> tuple[HiddenEffect, ...]:
    if kind is Kind.CLEAN:
        return ()
    if kind is Kind.OPEN_SET:
        return (_one(random, random.choice(OPEN_SIZES)),)
    if kind is Kind.LATER_SINGLE:
        return (_one(random, random.choice(LATER_SIZES)),)
    if kind is Kind.PAIR:
        return _pair(random)
    if kind is Kind.SHARED_BY_JOINTS:
        candidates = [size for size in SHARED_SIZES if size.acts_on_joints]
        size = random.choice(candidates)
        count = random.randint(2, len(size.joints))
        return (_at(random, size, tuple(sorted(random.sample(size.joints, count)))),)
    return (_one(random, random.choice(SHARED_SIZES)),)


def _pair(random: Random) -> tuple[HiddenEffect, ...]:
    """Draws two different effects. Backlash and compliance are never drawn on the same joint: its gear can have only
    one."""
    first, second = (_one(random, size) for size in random.sample(SHARED_SIZES, 2))
    gives = ("backlash", "joint_compliance")
    while first.name in gives and second.name in gives and first.joints == second.joints:
        second = _one(random, next(size for size in SHARED_SIZES if size.effect == second.name))
    return first, second


def _one(random: Random, size: SizeRange) -> HiddenEffect:
    return _at(random, size, (random.choice(size.joints),) if size.acts_on_joints else ())


def _at(random: Random, size: SizeRange, joints: tuple[int, ...]) -> HiddenEffect:
    """Returns an effect of one strength and sign at all its joints; its other parameters are drawn once."""
    strength = random.random()
    sign = random.choice((-1, 1)) if size.signed else 1
    drawn_once = random.getrandbits(64)
    places: tuple[int | None, ...] = joints or (None,)
    values = tuple(draw_values(Random(drawn_once), size, joint, strength, sign) for joint in places)
    return HiddenEffect(size.effect, joints, values, strength)
