"""Which effects may explain residual torques, and on which joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from model import layout as at
from model.discrepancy.candidates.library import is_beside
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.place import Place
from model.discrepancy.inverse_dynamics.starts import narrowed, starts_of
from model.discrepancy.inverse_dynamics.stated_numbers import number_trials, stated_trial
from model.discrepancy.inverse_dynamics.trial import Trial
from model.effects.effect import Effect
from model.effects.library import library
from model.inverse_dynamics.recorded_motion import RecordedMotion, turns_round
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES, levels_along
from model.machine_model.effect_parameters import suits_drive
from model.machine_model.model import Model

UNSEEN = ("backlash", "damping")
"""Part of an effect that torques do not show: the damping of a contact acts in its vibration, above every cutoff."""
SENSOR_EFFECTS = ("potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity")
BENT = "potentiometer_nonlinearity"
FREED_BENDS = ("bend_1", "bend_2", "bend_3", "bend_4")
"""Terms of a bent sensor that a trial frees; the shorter waves keep the priors of a sound one."""
UNDER_LOAD = {"load_dependent_friction": "arm", "gravity_torque_friction": "share"}
"""Effects whose friction goes with a load that the posture decides, and the parameter that multiplies it."""
SPRINGS = ("spring_torque", "one_sided_spring")
"""Effects whose torque goes with the position and does not repeat every turn: no joint that turns round has them, since
after a turn it is where it was."""
CONSTANT_LOAD = 0.05
"""Relative change of a load below which it counts as constant."""


def list_trials(model: Model, now: BalanceFit, case: TorqueCase) -> Iterator[Trial]:
    """Every effect that the model lacks, joint by joint, and those of the whole machine once; of what the file states,
    whether it is another size than stated; and numbers of the machine that the fit has moved."""
    names, round_ = case.options.effects, turns_round(case.records, model.machine)
    for name, effect in library().items():
        if name in NOT_IN_TORQUES or (names is not None and name not in names):
            continue
        places: list[tuple[int, ...]] = (
            [()] if effect.whole_machine else [(j,) for j in case.options.joints or model.machine.modelled_joints]
        )
        for joints in places:
            if _present(model, name, joints):
                if (again := stated_trial(model, name, joints, now)) is not None:
                    yield again
                continue
            if not _possible(model, effect, joints) or (names is None and not is_beside(model, name, joints)):
                continue
            if name in UNDER_LOAD and _constant_load(model, name, joints[0] - 1, case.records):
                continue  # the same torque as Coulomb friction, by a longer name
            if name in SPRINGS and round_[joints[0] - 1]:
                continue
            trial = _trial(model, name, joints, now)
            if trial.starts:
                yield trial
    yield from number_trials(model, now, case)


def _trial(model: Model, name: str, joints: tuple[int, ...], now: BalanceFit) -> Trial:
    """One effect on one joint, or of the whole machine."""
    wider = model.with_effect(name, joints)
    place = Place(wider, joints[0] - 1 if joints else 0, now.balance.records, now.residual)
    sizes = recorded_sizes(wider, now.balance.records)
    added = (
        sizes.get(p.name, p) for p in wider.parameters if p.name not in model.by_name and (p.effect, p.part) != UNSEEN
    )
    own = tuple(narrowed(p, place) for p in added if p.effect != BENT or p.part in FREED_BENDS)
    amplitudes = tuple(p.name for p in own if p.null is not None)
    return Trial(name, joints, wider, own, amplitudes, tuple(starts_of(name, own, place)))


def _constant_load(model: Model, name: str, column: int, records: Sequence[RecordedMotion]) -> bool:
    """Whether the load that friction goes with is the same everywhere along the records."""
    rubbing = model.with_effect(name, (column + 1,), {UNDER_LOAD[name]: 1.0})
    levels = np.concatenate([levels_along(rubbing, r)[r.rows, column] for r in records])
    return bool(np.ptp(levels) < CONSTANT_LOAD * np.abs(levels).max() + 1e-12)


def _present(model: Model, name: str, joints: tuple[int, ...]) -> bool:
    return any(u.name == name and (not joints or set(u.joints) & set(joints)) for u in model.effects)


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
