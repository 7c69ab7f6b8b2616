"""Every effect of the library on every joint, as a trial of the closed loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.lifted import (
    BENT,
    FREED_BENDS,
    LIMIT,
    MOST_OF_A_RECORD,
    TRIED_QUANTILES,
    has_effect,
    is_beside,
    stated_trial,
    typical,
)
from model.discrepancy.engine.probing import Start, Trial
from model.discrepancy.options import TorqueOptions
from model.discrepancy.readings.observation import Observation
from model.effects.effect import JointScale, Tone
from model.effects.library import effect, library
from model.machine_model.effect_parameters import effect_parameters, suits_drive
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.chain_of_model import gravity_loads

TIMES: Mapping[str, tuple[float, ...]] = {
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
"""Sizes, in expected deviations, of effects whose response is not proportional to their parameter."""
SMALL = 0.002
"""Share of its expected size at which any other effect is tried: a proportional response gives the size by itself. It
is small because an effect that acts like a tolerance parameter differs from it only by the cost of that parameter's
prior, which a curved response would hide."""
STICTION, STRIBECK = "stiction", "stribeck_friction"
STICTION_SPEED = 0.045
"""Speed that separates stiction from Stribeck friction, rad/s: friction that falls below it counts as stiction. At 20
ms and 12 bits the joint moves there by less than a count per sample, so that no reading shows the fall."""
SHAPES: Mapping[str, tuple[dict[str, float], ...]] = {
    STRIBECK: ({"speed": 0.09}, {"speed": 0.25}),
    "resistance_drift": ({"time_constant": 10.0}, {"time_constant": 30.0}),
    "resistance_rise": ({"time_constant": 15.0}, {"time_constant": 60.0}),
}
"""Values of numbers that only shape an effect, by part: rad/s, s."""
SHARES_OF_LIMIT = (0.85, 0.65, 0.45)
"""Shares of the largest recorded drive at which a limit is tried."""
GRAVITY_FRICTION = "gravity_torque_friction"
"""Friction in proportion to a gravity torque."""
SPRINGS = ("spring_torque", "one_sided_spring")
POSTURES, LEAST_CHANGE = 16, 1e-6
"""Number of postures at which gravity torques are compared, and the relative change that counts as one."""
NO_SCALES: Mapping[int, JointScale] = MappingProxyType({})


def list_trials(
    now: Fit, observation: Observation, options: TorqueOptions, excluded: Sequence[str] = ()
) -> Iterator[Trial]:
    """Every effect that the model lacks, joint by joint, and those of the whole machine once; of what the file states,
    whether it is another size than stated. Tones are left to spectra."""
    model, asked = now.fitted_model, options.effects
    free = {u.name for u in now.unknowns if u.deviation is None}
    names = tuple(library()) if asked is None else tuple(effect(name).name for name in asked)
    for name in names:
        if effect(name).tone is not None or name in excluded:
            continue
        places: Sequence[tuple[int, ...]] = [()]
        if not effect(name).whole_machine:
            places = [(j,) for j in options.joints or model.machine.modelled_joints]
        for joints in places:
            if not _is_possible(model, name, joints, anything=asked is None):
                continue
            if has_effect(model, name, joints):
                if (stated := stated_trial(model, name, joints, now, (SMALL,))) is not None:
                    yield stated
                continue
            for trial in _variants(model, name, joints, observation):
                if not {p.name for p in trial.parameters if p.null is not None} <= free:
                    yield trial


def _is_possible(model: Model, name: str, joints: tuple[int, ...], *, anything: bool) -> bool:
    """Whether an effect can do something there; of those that nobody asked for, whether it is to be tried now."""
    if not joints:
        return _has_room(model, name, joints)
    if not suits_drive(model.machine, name, joints[0]) or (anything and not is_beside(model, name, joints)):
        return False
    if name == GRAVITY_FRICTION and not _gravity_varies(model, joints[0]):
        return False
    return _has_room(model, name, joints)


def _has_room(model: Model, name: str, joints: tuple[int, ...]) -> bool:
    """Whether the model can have the law here: a user's own effect acts only on the joints of its file, and a model has
    limited room for such effects."""
    kind = effect(name)
    own = {use.name for use in model.effects if use.file is not None}
    own |= {name} if kind.file is not None else set()
    taken = sum(len(effect(one).parameters) for one in own)
    return taken <= at.USER_COLUMNS and (not kind.joints or set(joints) <= set(kind.joints))


def _gravity_varies(model: Model, joint: int) -> bool:
    """Whether a joint's gravity torque depends on the posture. Friction that goes with it does nothing where there is
    none, and is Coulomb friction by a longer name where it is constant."""
    column = model.machine.modelled_joints.index(joint)
    postures = np.random.default_rng(0).uniform(-np.pi, np.pi, (POSTURES, model.joint_count))
    torque = np.abs(gravity_loads(model, postures)[:, column])
    return bool(np.ptp(torque) > LEAST_CHANGE * float(torque.max(initial=0.0)) + 1e-12)


def _variants(model: Model, name: str, joints: tuple[int, ...], observation: Observation) -> Iterator[Trial]:
    """Trials of one name: stiction stands for two laws."""
    bounds = {"speed": (STICTION_SPEED, 10.0)} if name == STRIBECK else {}
    if name == STICTION and not has_effect(model, STRIBECK, joints):
        slow = {"speed": (0.1 * STICTION_SPEED, STICTION_SPEED)}
        shape = ({"speed": 0.5 * STICTION_SPEED},)
        yield _trial(model, name, joints, observation, slow, law=STRIBECK, shapes=shape)
    yield _trial(model, name, joints, observation, bounds)


def _trial(
    model: Model,
    name: str,
    joints: tuple[int, ...],
    observation: Observation,
    bounds: Mapping[str, tuple[float, float]],
    law: str = "",
    shapes: Sequence[Mapping[str, float]] | None = None,
) -> Trial:
    """One effect on one joint, or of the whole machine. bounds, shapes: by part."""
    wider = model.with_effect(law or name, joints)
    added = [p for p in wider.parameters if p.name not in model.by_name]
    freed = [p for p in added if p.effect != BENT or p.part in FREED_BENDS]
    own = _sized(wider, law or name, joints, freed, observation)
    shapes = SHAPES.get(name, ({},)) if shapes is None else shapes
    if name in SPRINGS:
        rest, positions = wider.machine.rest_posture, _recorded(observation, joints[0])
        if name == "one_sided_spring":  # it shows only where the joint becomes taut
            low, high = (float(x) for x in np.nanquantile(positions, MOST_OF_A_RECORD))
            bounds = {**bounds, "rest": (low, high)}
            shapes = [{"rest": float(x)} for x in np.nanquantile(positions, TRIED_QUANTILES)]
        else:
            shapes = ({"rest": 0.0 if rest is None else rest[joints[0] - 1]},)
    own = tuple(_within(p, bounds) for p in own)
    times = TIMES.get(law or name, (1.0,))
    sides = (1.0, -1.0) if law or name in TIMES else (1.0,)
    starts: list[Start] = []
    for shape in shapes:
        for size in (side * t for t in times for side in sides):
            start = {p.name: shape.get(p.part, p.value) if p.null is None else typical(p, size) for p in own}
            absent = all(start[p.name] == typical(p, 0.0) for p in own if p.null is not None)
            if not absent and start not in starts:
                starts.append(start)
    amplitudes = tuple(p.name for p in own if p.null is not None)
    if name == LIMIT:
        starts += _recorded_limits(observation, joints[0], own, starts)
    is_linear = (law or name) not in TIMES
    shares = (SMALL,) if is_linear else (1.0,)
    return Trial(name, joints, wider, own, amplitudes, tuple(starts), shares=shares, linear=is_linear, law=law)


def _within(p: Parameter, bounds: Mapping[str, tuple[float, float]]) -> Parameter:
    low, high = bounds.get(p.part, (p.low, p.high))
    return replace(p, low=max(p.low, low), high=min(p.high, high))


def _sized(
    model: Model, law: str, joints: tuple[int, ...], own: Sequence[Parameter], observation: Observation
) -> tuple[Parameter, ...]:
    """Parameters with bounds and deviations that suit the sizes of joints that records tell better than the file."""
    if not set(joints) & set(observation.scales):
        return tuple(own)
    known = {p.name: p for p in effect_parameters(model.machine, law, joints, shared=False, scales=observation.scales)}
    return tuple(
        replace(p, low=q.low, high=q.high, deviation=q.deviation) if (q := known.get(p.name)) is not None else p
        for p in own
    )


def _recorded(observation: Observation, joint: int) -> Floats:
    """Recorded positions of a joint, rad (m)."""
    column = observation.machine.modelled_joints.index(joint)
    return np.concatenate([r.inputs.readings[:, column] for r in observation.records])


def _recorded_limits(
    observation: Observation, joint: int, own: Sequence[Parameter], starts: Sequence[Start]
) -> list[Start]:
    """Limits that the record reaches, where the usual ones are all beyond it."""
    if not all(r.inputs.has_drive for r in observation.records):
        return []
    column = observation.machine.modelled_joints.index(joint)
    largest = max(float(np.abs(r.inputs.drive[:, column]).max()) for r in observation.records)
    (limit,) = (p for p in own if p.null is not None)
    if largest <= 0.0 or any(start[limit.name] < largest for start in starts):
        return []
    return [{limit.name: share * largest} for share in SHARES_OF_LIMIT if share * largest > limit.low]


def tone_trial(
    model: Model,
    name: str,
    joint: int,
    over: Tone,
    rates: Floats,
    slowest: float,
    places: int,
    observation: Observation,
) -> Trial | None:
    """A tone with rates (k,) that a spectrum has proposed; None where the model has one there.

    slowest: the least rate that was looked at. A fit may not go below it: part of a slow wave repeats nothing, and is
    as good as a spring. places: rates that were looked at.
    """
    if has_effect(model, name, (joint,)):
        return None
    wider = model.with_effect(name, (joint,))
    added = [p for p in wider.parameters if p.name not in model.by_name]
    own = tuple(_within(p, {over.value: (slowest, np.inf)}) for p in _sized(wider, name, (joint,), added, observation))
    amplitudes = tuple(p.name for p in own if p.null is not None)
    starts = tuple(
        {p.name: float(np.clip(rate, p.low, p.high)) if p.part == over else typical(p) for p in own} for rate in rates
    )
    return Trial(name, (joint,), wider, own, amplitudes, starts, shares=(SMALL,), places=places)
