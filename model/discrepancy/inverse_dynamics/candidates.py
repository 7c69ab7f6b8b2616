"""Which effects may explain residual torques, and on which joints; and numbers that the file states, as candidates.

Numbers may be further from what the file states than their deviations allow. A link that is heavier than stated is
fitted as a mass within its tolerance, however far off, as long as the prior costs less than what the record gains. A
candidate lifts that prior. Where an effect of the library does the same as the number (an added mass, a weakened
magnet), the effect alone is tried: two names for one thing would be a group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from model import layout as at
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.lifted import (
    BENT,
    FREED_BENDS,
    expected_of,
    has_effect,
    is_beside,
    lift_priors,
    stated_trial,
)
from model.discrepancy.engine.priors import prior_distance
from model.discrepancy.engine.probing import Trial
from model.discrepancy.inverse_dynamics.starts import NONLINEAR, Place, narrowed, starts_of
from model.discrepancy.options import TorqueOptions
from model.effects.effect import Effect
from model.effects.library import library
from model.fitting.phases import phase_unknowns
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.recorded_motion import RecordedMotion, turns_round
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import DIFFERENCE, NOT_IN_TORQUES, levels_along
from model.machine_model.effect_parameters import suits_drive
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

SHARES = (1.0, DIFFERENCE)
"""Shares of a start at which it is tried. Also at the step of the fit's own derivatives: what the tolerances took over
of an effect would be there twice at its full size, and friction would hold a different part of it where a joint
turns."""
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


def number_trials(model: Model, now: Fit, options: TorqueOptions) -> Iterator[Trial]:
    """The machine's own numbers that the fit has moved, those of one kind on one joint together; where the effects to
    look for are named, those among them."""
    asked = options.effects
    tolerances = expected_of(now)
    found: dict[tuple[str, tuple[int, ...]], list[tuple[Parameter, Unknown]]] = {}
    for p in model.parameters:
        name, u = NUMBERS.get((p.component, p.part)), tolerances.get(p.name)
        if name is None or u is None or p.effect is not None or len(p.joints) != 1:
            continue
        if asked is not None and name not in asked:
            continue
        if options.joints and p.joints[0] not in options.joints:
            continue
        if not _has_effect(model, p, _is_lower(p, now, tolerances)):
            found.setdefault((name, p.joints), []).append((p, u))
    for (name, joints), numbers in found.items():
        moved = [(p, u) for p, u in numbers if abs(prior_distance(u, now.values[p.name])[0]) >= TRIED]
        if moved:
            # both constants of a motor are of one magnet: one that is held would hold the other
            yield lift_priors(model, name, joints, now, numbers if name == "wrong_torque_constant" else moved, SHARES)


def take_back(effect: str, own: Sequence[Parameter], now: Fit) -> dict[str, float]:
    """Values with which an effect has taken over what the fit has made of stated numbers, which are as stated again:
    the torques are those of the fit. Empty for effects whose torque is a sum with that of the numbers, where a fit goes
    from one to the other in a step.

    Both constants of a magnet are multiplied by what a weakened one has left.
    """
    values: dict[str, float] = {}
    for loss in own if effect == "weakened_magnet" else ():
        both = [u for u in expected_of(now).values() if u.parameter.part in MAGNET and u.joints == loss.joints]
        if not both:
            continue
        left = float(np.mean([now.values[u.name] / u.expected for u in both]))
        values[loss.name] = float(np.clip(1.0 - left, loss.low, loss.high))
        values |= {u.name: now.values[u.name] / (1.0 - values[loss.name]) for u in both}
    return values


def _is_lower(p: Parameter, now: Fit, tolerances: Mapping[str, Unknown]) -> bool:
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


UNSEEN = ("backlash", "damping")
"""Part of an effect that torques do not show: the damping of a contact acts in its vibration, above every cutoff."""
SENSOR_EFFECTS = ("potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity")
UNDER_LOAD = {"load_dependent_friction": "arm", "gravity_torque_friction": "share"}
"""Effects whose friction goes with a load that the posture decides, and the parameter that multiplies it."""
SPRINGS = ("spring_torque", "one_sided_spring")
"""Effects whose torque goes with the position and does not repeat every turn: no joint that turns round has them, since
after a turn it is where it was."""
CONSTANT_LOAD = 0.05
"""Relative change of a load below which it counts as constant."""


def list_trials(now: Fit, records: Sequence[RecordedMotion], options: TorqueOptions) -> Iterator[Trial]:
    """Every effect that the model lacks, joint by joint, and those of the whole machine once; of what the file states,
    whether it is another size than stated; and numbers of the machine that the fit has moved."""
    model, names = now.fitted_model, options.effects
    round_ = turns_round(records, model.machine)
    for name, effect in library().items():
        if name in NOT_IN_TORQUES or (names is not None and name not in names):
            continue
        places: list[tuple[int, ...]] = (
            [()] if effect.whole_machine else [(j,) for j in options.joints or model.machine.modelled_joints]
        )
        for joints in places:
            if has_effect(model, name, joints):
                if (again := stated_trial(model, name, joints, now, SHARES)) is not None:
                    yield again
                continue
            if not _possible(model, effect, joints) or (names is None and not is_beside(model, name, joints)):
                continue
            if name in UNDER_LOAD and _constant_load(model, name, joints[0] - 1, records):
                continue  # the same torque as Coulomb friction, by a longer name
            if name in SPRINGS and round_[joints[0] - 1]:
                continue
            trial = _trial(model, name, joints, now, records)
            if trial.starts:
                yield trial
    yield from number_trials(model, now, options)


def _trial(model: Model, name: str, joints: tuple[int, ...], now: Fit, records: Sequence[RecordedMotion]) -> Trial:
    """One effect on one joint, or of the whole machine."""
    wider = model.with_effect(name, joints)
    place = Place(wider, joints[0] - 1 if joints else 0, records, now.signals)
    sizes = recorded_sizes(wider, records)
    added = (
        sizes.get(p.name, p) for p in wider.parameters if p.name not in model.by_name and (p.effect, p.part) != UNSEEN
    )
    own = tuple(narrowed(p, place) for p in added if p.effect != BENT or p.part in FREED_BENDS)
    amplitudes = tuple(p.name for p in own if p.null is not None)
    every = (u.parameter for u in phase_unknowns(wider, len(records)))
    phases = tuple(p for p in every if (p.effect, p.joints) == (name, joints))
    starts = tuple(starts_of(name, (*own, *phases), place))
    linear = name not in NONLINEAR
    shares = SHARES if linear else (1.0,)
    return Trial(name, joints, wider, own, amplitudes, starts, shares=shares, linear=linear, phases=len(phases))


def _constant_load(model: Model, name: str, column: int, records: Sequence[RecordedMotion]) -> bool:
    """Whether the load that friction goes with is the same everywhere along the records."""
    rubbing = model.with_effect(name, (column + 1,), {UNDER_LOAD[name]: 1.0})
    levels = np.concatenate([levels_along(rubbing, r)[r.rows, column] for r in records])
    return bool(np.ptp(levels) < CONSTANT_LOAD * np.abs(levels).max() + 1e-12)


def _possible(model: Model, effect: Effect, joints: tuple[int, ...]) -> bool:
    """Whether the effect can do anything on this machine."""
    falls = any(model.machine.gravity)
    if not joints:
        return effect.name != "base_tilt" or falls
    if not suits_drive(model.machine, effect.name, joints[0]):
        return False
    joint, row = model.machine.joint(joints[0]), at.slot(joints[0], 0)
    needs = {
        "centre_of_mass": model.vector[row + at.A] != 0.0,
        **dict.fromkeys(UNDER_LOAD, falls),
        **dict.fromkeys(
            SENSOR_EFFECTS,
            joint.sensor is not None and joint.sensor.measures == "position",
        ),
    }
    if effect.is_flexible and not model.vector[row + at.ROTOR_INERTIA] > 0:
        return False
    return bool(needs.get(effect.name, True)) and (not effect.joints or set(joints) <= set(effect.joints))
