"""Numbers that the file states, as candidates: they may be further from what it states than their deviations allow.

A link that is heavier than stated is fitted as a mass within its tolerance, however far off, as long as the prior costs
less than what the record gains. A candidate lifts that prior. Where an effect of the library does the same as the
number (an added mass, a weakened magnet), the effect alone is tried: two names for one thing would be a group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from model import layout as at
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.priors import prior_distance
from model.discrepancy.inverse_dynamics.trial import Trial
from model.fitting.unknowns import Unknown
from model.machine_model.effect_parameters import suits_drive
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

TRIED = 2.0
"""Distance, in deviations, from which a number is tried: half of what it takes to be named, because several numbers may
share one distance."""
MAGNET = ("torque_constant", "back_emf_constant")
"""Numbers of a motor that are of one magnet."""
NUMBERS = {
    ("motor", "rotor_inertia"): "wrong_rotor_inertia",
    ("drive", "inertia"): "wrong_rotor_inertia",
    ("drive", "gain"): "wrong_drive_gain",
    ("motor", "resistance"): "wrong_resistance",
    ("motor", "torque_constant"): "wrong_torque_constant",
    ("motor", "back_emf_constant"): "wrong_torque_constant",
    ("motor", "gear_ratio"): "wrong_gear_ratio",
    **{("link", f"inertia_{entry}"): "wrong_link_inertia" for entry in ("xx", "yy", "zz", "xy", "xz", "yz")},
    **{("link", f"centre_{axis}"): "wrong_link_centre" for axis in "xyz"},
    **{("link", part): "wrong_geometry" for part in ("length", "offset", "radius")},
}
"""Name of the step, by component and part of the number. Masses, loads, friction and sensors' zeros have effects of the
library that do the same."""


def stated_trial(model: Model, name: str, joints: tuple[int, ...], now: BalanceFit) -> Trial | None:
    """An effect that the file states for this joint: it may be larger or smaller than within its stated deviations."""
    tolerances = _expected(now)
    mine = (p for p in model.parameters if p.effect == name and p.joints == joints and p.null is not None)
    own = tuple(p for p in mine if p.name in tolerances)
    return _lift_priors(model, name, joints, now, [(p, tolerances[p.name]) for p in own]) if own and joints else None


def number_trials(model: Model, now: BalanceFit, case: TorqueCase) -> Iterator[Trial]:
    """The machine's own numbers that the fit has moved, those of one kind on one joint together; where the effects to
    look for are named, those among them."""
    asked = case.options.effects
    tolerances = _expected(now)
    found: dict[tuple[str, tuple[int, ...]], list[tuple[Parameter, Unknown]]] = {}
    for p in model.parameters:
        name, u = NUMBERS.get((p.component, p.part)), tolerances.get(p.name)
        if name is None or u is None or p.effect is not None or len(p.joints) != 1:
            continue
        if asked is not None and name not in asked:
            continue
        if case.options.joints and p.joints[0] not in case.options.joints:
            continue
        if not _has_effect(model, p, _is_lower(p, now, tolerances)):
            found.setdefault((name, p.joints), []).append((p, u))
    for (name, joints), numbers in found.items():
        moved = [(p, u) for p, u in numbers if abs(prior_distance(u, now.values[p.name])[0]) >= TRIED]
        if moved:
            # both constants of a motor are of one magnet: one that is held would hold the other
            yield _lift_priors(model, name, joints, now, numbers if name == "wrong_torque_constant" else moved)


def take_back(effect: str, own: Sequence[Parameter], now: BalanceFit) -> dict[str, float]:
    """Values with which an effect has taken over what the fit has made of stated numbers, which are as stated again:
    the torques are those of the fit. Empty for effects whose torque is a sum with that of the numbers, where a fit goes
    from one to the other in a step.

    Both constants of a magnet are multiplied by what a weakened one has left.
    """
    values: dict[str, float] = {}
    for loss in own if effect == "weakened_magnet" else ():
        both = [u for u in _expected(now).values() if u.parameter.part in MAGNET and u.joints == loss.joints]
        if not both:
            continue
        left = float(np.mean([now.values[u.name] / u.expected for u in both]))
        values[loss.name] = float(np.clip(1.0 - left, loss.low, loss.high))
        values |= {u.name: now.values[u.name] / (1.0 - values[loss.name]) for u in both}
    return values


def _expected(now: BalanceFit) -> dict[str, Unknown]:
    """The unknowns of a fit of which something is expected, by name."""
    return {u.name: u for u in now.unknowns if u.deviation is not None and not u.nuisance}


def _lift_priors(
    model: Model, name: str, joints: tuple[int, ...], now: BalanceFit, numbers: Sequence[tuple[Parameter, Unknown]]
) -> Trial:
    """Stated numbers without their priors."""
    own = tuple(p for p, _ in numbers)
    stated = tuple(replace(p, value=u.expected, deviation=u.as_stated.deviation) for p, u in numbers)
    origin = {p.name: now.values[p.name] for p in own}
    start = {p.name: origin[p.name] + u.scale for p, u in numbers}
    return Trial(name, joints, model, own, tuple(origin), (start,), stated, origin)


def _is_lower(p: Parameter, now: BalanceFit, tolerances: Mapping[str, Unknown]) -> bool:
    """Whether the fit has lowered a number; of a motor's two constants, the one that is further off says it of both."""
    own = [tolerances[p.name]]
    if p.part in MAGNET:
        own = [u for u in tolerances.values() if u.parameter.part in MAGNET and u.joints == p.joints]
    farthest = max(own, key=lambda u: abs(prior_distance(u, now.values[u.name])[0]))
    return now.values[farthest.name] < farthest.expected


def _has_effect(model: Model, p: Parameter, lower: bool) -> bool:
    """Whether an effect of the library changes the same number that way."""
    joint = p.joints[0]
    if p.part == "centre_x":
        return bool(model.vector[at.slot(joint, at.A)] != 0.0)
    return p.part in MAGNET and lower and suits_drive(model.machine, "weakened_magnet", joint)
