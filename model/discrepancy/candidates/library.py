"""Hypotheses: every effect of the library on every joint, as a model with free parameters and trial sizes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from model import layout as at
from model.discrepancy.output_error.observation import Observation
from model.effects.effect import JointScale, Tone
from model.effects.library import BESIDE, effect, library
from model.machine_model.effect_parameters import effect_parameters, suits_drive
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.chain_of_model import gravity_loads

TRIALS: Mapping[str, tuple[float, ...]] = {
    "backlash": (0.15, 0.5, 1.5),
    "joint_compliance": (0.15, 0.5, 1.5),
    "dead_zone": (0.1, 0.4, 1.5),
    "amplifier_threshold": (0.2, 0.6, 1.5, 4.0),
    "supply_limit": (0.3, 0.8, 1.3),
    "input_delay": (0.1, 0.4, 1.2, 2.5),
    "motor_inductance": (0.6, 2.0, 8.0),
    "stiction": (0.5, 2.0, 6.0),
    "stribeck_friction": (0.4, 1.5, 5.0),
    "lost_set_points": (0.1, 0.5, 1.5),
    "direction_dependent_friction": (0.3, 2.0),
    "direction_dependent_viscous_friction": (0.3, 2.0),
    "direction_dependent_gear_loss": (0.3, 2.0),
    "one_sided_spring": (0.3, 2.0),
}
"""Trial sizes, in expected deviations, of effects whose response is not proportional to their parameter."""
FREED_BENDS = ("bend_1", "bend_2", "bend_3", "bend_4")
"""Terms of a bent potentiometer that a hypothesis frees from their priors; the shorter waves keep those of a sound
one."""
SMALL = 0.002
"""The one trial size, in expected deviations, of all other effects: a proportional response gives the size by itself.
It is small because an effect that acts like a tolerance parameter differs from it only by the cost of that parameter's
prior, which a curved response would hide."""
Value = TypeVar("Value")
NO_SCALES: Mapping[int, JointScale] = MappingProxyType({})
"""Every joint's natural sizes are those of the machine file."""
STICTION_SPEED = 0.045
"""Speed that separates stiction from Stribeck friction, rad/s: friction that falls below it counts as stiction. At 20
ms and 12 bits the joint moves there by less than a count per sample, so that no reading shows the fall."""
STICTION_SHAPE = 0.025
"""Trial value of the speed over which friction falls that counts as stiction, rad/s."""
SHAPES: Mapping[str, tuple[dict[str, float], ...]] = {
    "stribeck_friction": ({"speed": 0.09}, {"speed": 0.25}),
    "resistance_drift": ({"time_constant": 10.0}, {"time_constant": 30.0}),
    "resistance_rise": ({"time_constant": 15.0}, {"time_constant": 60.0}),
}
"""Trial values of numbers that only shape an effect, by part: rad/s, s."""


TRIED_QUANTILES, MOST_OF_A_RECORD = (0.2, 0.5, 0.8), (0.05, 0.95)
"""Quantiles of a joint's recorded positions at which a cable is tried to become taut, and between which it must: one
that is taut in the whole record is a spring, and one that never is, is nothing. The same of the drive, of dead zones
that are tried, and of the speed, by which Stribeck friction has to have faded to 37 % (1/e): what fades at higher
speeds than were recorded is Coulomb friction."""
GRAVITY_FRICTION = "gravity_torque_friction"
"""Friction in proportion to a gravity torque."""
POSTURES, LEAST_CHANGE = 16, 1e-6
"""Number of postures at which gravity torques are compared, and the relative change that counts as one."""


@dataclass(frozen=True)
class Hypothesis:
    """One effect at one place: what a `Candidate` of the answer was tested as.

    Args:
        name: of the effect, as answered. joints: where; none for the whole machine.
        model: with the effect in it, at a value where it does nothing. free: its parameters, which have no prior.
        trials: values by full name, one set per trial.
        proportional: whether its response is proportional to its size, so that one trial gives the size.
        bounds: by full name; narrower than the parameter's own.
    """

    name: str
    joints: tuple[int, ...]
    model: Model
    free: tuple[Parameter, ...]
    trials: tuple[dict[str, float], ...]
    proportional: bool
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def tone(self) -> Tone | None:
        """What it repeats over, if it is a tone."""
        return effect(self.name).tone

    @property
    def main(self) -> tuple[Parameter, ...]:
        """The free parameters that have a value at which the effect is absent."""
        return tuple(p for p in self.free if p.null is not None)


def hypotheses(
    model: Model,
    effects: Sequence[str] | None = None,
    joints: Sequence[int] | None = None,
    scales: Mapping[int, JointScale] = NO_SCALES,
) -> tuple[Hypothesis, ...]:
    """Every effect that the model could take, except those that a spectrum finds.

    Raises SpecError for unknown names, and for joints that are not modelled.

    Args:
        effects: names; None for the whole library. joints: only on these; None for all. scales: natural sizes of joints
            (from 1) that the records tell better than the machine file.
    """
    names = tuple(library()) if effects is None else tuple(effect(name).name for name in effects)
    found: list[Hypothesis] = []
    for name in names:
        if effect(name).tone is not None:
            continue
        places = ((),) if effect(name).whole_machine else tuple((j,) for j in joints or model.machine.modelled_joints)
        for place in places:
            if place and not suits_drive(model.machine, name, place[0]):
                continue
            if place and effects is None and not is_beside(model, name, place):
                continue
            if place and name == GRAVITY_FRICTION and not _gravity_varies(model, place[0]):
                continue
            found.extend(_variants(_Place(model, name, place, name, scales)))
    return tuple(found)


def is_beside(model: Model, name: str, joints: Sequence[int]) -> bool:
    """Whether the model has, on the joints, the effect beside which this one is tried, if there is such a one."""
    first = BESIDE.get(name)
    return first is None or any(use.name == first and set(joints) <= set(use.joints) for use in model.effects)


def _gravity_varies(model: Model, joint: int) -> bool:
    """Whether a joint's gravity torque depends on the posture. Friction that goes with it does nothing where there is
    none, and is Coulomb friction by a longer name where it is constant."""
    column = model.machine.modelled_joints.index(joint)
    postures = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSTURES, model.joint_count))
    torque = np.abs(gravity_loads(model, postures)[:, column])
    return bool(np.ptp(torque) > LEAST_CHANGE * float(torque.max(initial=0.0)) + 1e-12)


def tone(
    model: Model,
    name: str,
    joint: int,
    values: Mapping[str, float],
    slowest: float,
    scales: Mapping[int, JointScale] = NO_SCALES,
) -> Hypothesis | None:
    """A hypothesis with a rate that a spectrum has proposed. values: by the part of the effect.

    slowest: the least rate that was looked at. A fit may not go below it: part of a slow wave repeats nothing, and is
    as good as a spring.
    """
    over = effect(name).tone
    assert over is not None
    bounds = {over.value: (slowest, math.inf)}
    return _hypothesis(_Place(model, name, (joint,), name, scales), (dict(values),), bounds=bounds)


def on_joints(model: Model, alike: Sequence[Hypothesis], values: Mapping[str, float]) -> Hypothesis | None:
    """One law on all joints of hypotheses about single ones, with one trial. values: by full name. None where the model
    has the effect on some of the joints already."""
    first = alike[0]
    joints = tuple(sorted(j for c in alike for j in c.joints))
    bounds = {name: own for c in alike for name, own in c.bounds.items()}
    place = _Place(model, first.name, joints, first.free[0].effect or first.name)
    found = _hypothesis(place, (dict(values),), bounds=bounds)
    if found is None or not {j for p in found.free for j in p.joints} >= set(joints):
        return None
    own = {p.name: p for c in alike for p in c.free}
    return replace(found, free=tuple(own.get(p.name, p) for p in found.free))


@dataclass(frozen=True)
class _Place:
    """An effect on joints of a model. law: the effect whose law is simulated, because a name may stand for two. scales:
    natural sizes of joints that are known better than from the machine file."""

    model: Model
    name: str
    joints: tuple[int, ...]
    law: str
    scales: Mapping[int, JointScale] = field(default_factory=dict)

    def sized(self, free: Sequence[Parameter]) -> tuple[Parameter, ...]:
        """Parameters of the law, with bounds and deviations that suit those sizes."""
        if not set(self.joints) & set(self.scales):
            return tuple(free)
        own = effect_parameters(self.model.machine, self.law, self.joints, shared=False, scales=self.scales)
        known = {p.name: p for p in own}
        return tuple(
            replace(p, low=q.low, high=q.high, deviation=q.deviation) if (q := known.get(p.name)) is not None else p
            for p in free
        )

    def has_law(self, effect: str | None, joints: Sequence[int]) -> bool:
        """Whether an effect on joints is this law, here."""
        return effect == self.law and (not self.joints or bool(set(self.joints) & set(joints)))

    @property
    def has_room(self) -> bool:
        """Whether the model can have the law here: a user's own effect acts only on the joints of its file, and a model
        has limited room for such effects."""
        kind = effect(self.law)
        own = {use.name for use in self.model.effects if use.file is not None}
        own |= {self.law} if kind.file is not None else set()
        taken = sum(len(effect(name).parameters) for name in own)
        return taken <= at.USER_COLUMNS and (not kind.joints or set(self.joints) <= set(kind.joints))


def _variants(place: _Place) -> list[Hypothesis]:
    shapes: Sequence[dict[str, float]] = SHAPES.get(place.name, ({},))
    if place.name in ("spring_torque", "one_sided_spring"):
        rest = place.model.machine.rest_posture
        shapes = ({"rest": 0.0 if rest is None else rest[place.joints[0] - 1]},)
    bounds = {"speed": (STICTION_SPEED, 10.0)} if place.name == "stribeck_friction" else {}
    found = [_sized(place, shapes, bounds)]
    if place.name == "stiction":
        stribeck = replace(place, law="stribeck_friction")
        found.insert(0, _sized(stribeck, ({"speed": STICTION_SHAPE},), {"speed": (0.004, STICTION_SPEED)}))
    return [c for c in found if c is not None]


def _sized(
    place: _Place,
    shapes: Sequence[dict[str, float]] = ({},),
    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> Hypothesis | None:
    """A hypothesis with trials of every main parameter, in every direction that its bounds allow, for every shape."""
    plain = _hypothesis(place, ({},), proportional=place.law not in TRIALS, bounds=bounds)
    if plain is None:
        return None
    trials = []
    for p in plain.main:
        size = p.deviation or 1.0
        steps = [(SMALL,)] if plain.proportional else [(m, -m) for m in TRIALS[place.law]]
        for step in (s for pair in steps for s in pair):
            value = (p.null if p.effect == "motor_inductance" and p.null is not None else p.value) + step * size
            if not p.low <= value <= p.high and plain.proportional:
                value = p.value - step * size
            if p.low <= value <= p.high:
                trials += [{p.name: value, **_full(plain.free, shape)} for shape in shapes]
    return replace(plain, trials=tuple(trials))


def _hypothesis(
    place: _Place,
    trials: Sequence[dict[str, float]],
    *,
    proportional: bool = False,
    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> Hypothesis | None:
    """The model with the effect; where it has the effect already, with a prior, the prior is lifted."""
    wider = place.model
    if any(place.has_law(use.name, use.joints) for use in wider.effects):
        if effect(place.law).tone is not None or place.law == "stribeck_friction":
            return None
        free = tuple(p for p in wider.parameters if place.has_law(p.effect, p.joints) and p.null is not None)
    else:
        if not place.has_room:
            return None
        wider = wider.with_effect(place.law, place.joints)
        free = tuple(p for p in wider.parameters if p.name not in place.model.by_name)
    if place.law == "potentiometer_nonlinearity":
        free = tuple(p for p in free if p.part in FREED_BENDS)
    free = place.sized(free)
    full = tuple(_full(free, trial) for trial in trials)
    return Hypothesis(place.name, place.joints, wider, free, full, proportional, _full(free, bounds))


def _full(free: Sequence[Parameter], values: Mapping[str, Value]) -> dict[str, Value]:
    """Values (or bounds) by full name, from full names or parts."""
    return {p.name: values[key] for p in free for key in values if key in (p.name, p.part)}


SHARES = (0.85, 0.65, 0.45)
"""Shares of the largest recorded drive at which a limit is tried, where the usual trials are all beyond it."""


def with_recorded_trials(hypothesis: Hypothesis, observation: Observation) -> Hypothesis:
    """The hypothesis; of a supply limit whose trials the record never reaches, with trials that it does reach; of a
    spring on one side, with rests among the recorded positions: it shows only where the joint becomes taut."""
    if hypothesis.name == "one_sided_spring":
        return _taut_within(hypothesis, observation)
    if hypothesis.name != "supply_limit" or not all(r.inputs.has_drive for r in observation.records):
        return hypothesis
    column = observation.machine.modelled_joints.index(hypothesis.joints[0])
    largest = max(float(np.abs(r.inputs.drive[:, column]).max()) for r in observation.records)
    (limit,) = hypothesis.main
    if largest <= 0.0 or any(trial[limit.name] < largest for trial in hypothesis.trials):
        return hypothesis
    trials = tuple({limit.name: share * largest} for share in SHARES if share * largest > limit.low)
    return replace(hypothesis, trials=(*hypothesis.trials, *trials))


def _taut_within(hypothesis: Hypothesis, observation: Observation) -> Hypothesis:
    """The hypothesis with its rest among the recorded positions of its joint, rad (m)."""
    rests = [p.name for p in hypothesis.free if p.part == "rest"]
    if not rests:
        return hypothesis
    column = observation.machine.modelled_joints.index(hypothesis.joints[0])
    positions = np.concatenate([r.inputs.readings[:, column] for r in observation.records])
    low, high = (float(x) for x in np.nanquantile(positions, MOST_OF_A_RECORD))
    tried = (float(x) for x in np.nanquantile(positions, TRIED_QUANTILES))
    trials = tuple({**trial, **dict.fromkeys(rests, rest)} for rest in tried for trial in hypothesis.trials)
    return replace(hypothesis, trials=trials, bounds={**hypothesis.bounds, **dict.fromkeys(rests, (low, high))})
