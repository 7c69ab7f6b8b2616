"""Torque that a recorded motion asks of the motors less torque that they were driven with, for any parameter values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.discrepancy.inverse_dynamics import supplied
from model.discrepancy.inverse_dynamics.records import TorqueRecord, acts_until_next_sample
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.simulation.bodies import chain_body
from model.simulation.own_table import own_table

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

BODY_COLUMNS = (*range(at.A, at.SHIFT + 1), at.ROTOR_INERTIA, at.GEAR, at.PRISMATIC, at.SHAPE)
SENSOR_COLUMNS = (at.POTENTIOMETER_GAIN, at.POTENTIOMETER_OFFSET, *at.BENDS)
FRICTION_COLUMNS = (at.COULOMB, at.COULOMB_ARM)
CONTACT_SHARE = 0.02
"""Torque through a transmission, as a share of its root mean square, over which play changes sides."""


@dataclass
class TorqueBalance:
    """Residual torques of records for one structure of model, compared samples only: one array (m, n) a record.

    What does not depend on the parameters that changed since is not worked out again.
    """

    model: Model
    records: tuple[TorqueRecord, ...]
    _kept: dict[str, tuple[bytes, list[Any]]] = field(default_factory=dict, repr=False)

    @cached_property
    def _own(self) -> NDArray[np.int64]:
        return own_table(self.model, np.float64)

    @cached_property
    def _settings(self) -> NDArray[np.int64]:
        settings = np.zeros(at.SETTINGS, dtype=np.int64)
        settings[at.PUBLISHED_LOADS] = int(is_rod_arm(self.model.machine))
        return settings

    def vector(self, values: Mapping[str, float]) -> Floats:
        """The model's flat vector with other values of some parameters."""
        vector = self.model.vector.copy()
        for name, value in values.items():
            vector[list(self.model.parameter(name).slots)] = value
        return vector

    def residual(self, values: Mapping[str, float]) -> list[Floats]:
        """Torque asked of the motors less torque that they were driven with, N·m (N), low-passed, compared samples."""
        vector = self.vector(values)
        joints = np.ascontiguousarray(vector[at.SHARED :].reshape(self.model.joint_count, at.PER_JOINT))
        chain = chain_body(np.ascontiguousarray(vector[: at.SHARED]), joints, self.model.flags)
        bodies = vector[: at.SHARED].tobytes() + joints[:, list(BODY_COLUMNS)].tobytes()
        sensors = joints[:, list(SENSOR_COLUMNS)].tobytes()
        motions = self._once("motion", sensors, lambda i: sensed(self.records[i], joints, self.model))
        needed = self._once("needed", sensors + bodies, lambda i: _needed(chain, motions[i]))
        friction = joints[:, list(FRICTION_COLUMNS)].tobytes()
        levels = self._once("levels", sensors + bodies + friction, lambda i: self._levels(chain, motions[i], joints))
        loads = levels
        if self._own.shape[1] > 0:
            loads = self._once("loads", sensors + bodies, lambda i: _gravity(chain, motions[i]))
        result = []
        for i, record in enumerate(self.records):
            volts = self._volts(record, vector, joints)
            torque = self._missing(record.time, motions[i], needed[i], volts, joints, levels[i], loads[i])
            torque = _held_by_friction(torque, levels[i], motions[i].contact, record.turns)
            result.append(record.compared(torque))
        return result

    def supplied_by_drive(self) -> list[Floats]:
        """Torque of the drive alone (m, n), as recorded: what residuals are shares of."""
        vector = self.model.vector
        joints = vector[at.SHARED :].reshape(self.model.joint_count, at.PER_JOINT)
        gain = joints[:, at.GEAR] * joints[:, at.TORQUE_CONSTANT] / joints[:, at.RESISTANCE]
        return [record.compared(record.drive * gain) for record in self.records]

    def _once(self, what: str, key: bytes, work: Callable[[int], Any]) -> list[Any]:
        kept = self._kept.get(what)
        if kept is None or kept[0] != key:
            kept = key, [work(i) for i in range(len(self.records))]
            self._kept[what] = kept
        return kept[1]

    def _levels(self, chain: ChainArrays, motion: Motion, joints: Floats) -> Floats:
        out = np.zeros_like(motion.position)
        if joints[:, list(FRICTION_COLUMNS)].any():
            supplied.friction_loads(chain, motion.position, joints, self._settings, out)
        return out

    def _volts(self, record: TorqueRecord, vector: Floats, joints: Floats) -> Floats:
        """Volts at the motors at the grid's times, after delay and limit."""
        late = vector[at.DELAY] + joints[:, at.EXTRA_DELAY]
        if acts_until_next_sample(self.model.machine):
            late = late + 0.5 * vector[at.PERIOD]
        drive = np.stack(
            [np.interp(record.time - late[j], record.time, record.drive[:, j]) for j in range(len(late))], axis=1
        ) if late.any() else record.drive  # fmt: skip
        out, without_zone = np.empty_like(drive), joints.copy()
        without_zone[:, at.DEAD_ZONE] = 0.0  # `_lost_in_dead_zone` has it
        supplied.amplified(np.ascontiguousarray(drive), without_zone, out)
        return out

    def _missing(
        self, time: Floats, motion: Motion, needed: Floats, volts: Floats, joints: Floats, level: Floats, load: Floats
    ) -> Floats:
        """Torque asked of the motors less torque that they were driven with (k, n)."""
        flags, speed = self.model.flags, motion.speed
        motor, beside = np.empty_like(needed), np.empty_like(needed)
        given = (volts, time, joints, flags, level, load, self._own, motor, beside)
        supplied.supplied_torque(motion.position, speed, motion.contact, speed, *given)
        asked = needed - beside
        if gives := [j for j in range(len(flags)) if flags[j] & at.HAS_FLEXIBILITY]:
            rotor_speed = speed.copy()
            for j in gives:
                extra = _twist_rate(asked[:, j], joints[j], time)
                rotor_speed[:, j] += extra
                inertia = joints[j, at.ROTOR_INERTIA] * joints[j, at.GEAR] ** 2
                needed = needed.copy()
                needed[:, j] += inertia * (motion.acceleration[:, j] + np.gradient(extra, time))
            supplied.supplied_torque(motion.position, speed, motion.contact, rotor_speed, *given)
            asked = needed - beside
        loss = joints[:, at.GEAR_LOSS]
        if loss.any():
            asked = asked / (1 - loss * motion.contact * np.sign(asked))
        return asked - motor + _lost_in_dead_zone(asked, speed, joints)


def _held_by_friction(left: Floats, level: Floats, contact: Floats, turns: Mask) -> Floats:
    """Residual torque (k, n) where a joint turns or stops for a moment: friction holds it there with whatever torque it
    takes, up to its level (k, n), and not with a share of that which follows the speed."""
    without = left - contact * level
    return np.where(turns, without + np.clip(-without, -level, level), left)


def _lost_in_dead_zone(asked: Floats, speed: Floats, joints: Floats) -> Floats:
    """Torque (k, n) for which the amplifier must be driven in vain, of the sign of the volts that the motor needs.

    The drive is predicted from the motion and not the other way round: a model in which the drive hardly acts would
    otherwise explain everything by bodies without mass.
    """
    width = joints[:, at.DEAD_ZONE]
    if not width.any():
        return np.zeros_like(asked)
    gain = joints[:, at.GEAR] * joints[:, at.TORQUE_CONSTANT] / joints[:, at.RESISTANCE]
    back_emf = joints[:, at.GEAR] * joints[:, at.BACK_EMF] * (1 + joints[:, at.BACK_EMF_ERROR])
    volts = asked / gain + back_emf * speed
    soft = CONTACT_SHARE * np.sqrt(np.mean(volts**2, axis=0)) + 1e-12
    return np.asarray(gain * width * np.tanh(volts / soft))


@dataclass(frozen=True)
class Motion:
    """The links' own motion (k, n), sensor errors taken out. contact: its direction as friction has it, in [−1, 1]."""

    position: Floats
    speed: Floats
    acceleration: Floats
    contact: Floats


def sensed(record: TorqueRecord, joints: Floats, model: Model) -> Motion:
    """The motion of which sensors with these errors would have given the readings."""
    wrong = joints[:, list(SENSOR_COLUMNS)]
    if not wrong.any():
        return Motion(record.position, record.speed, record.acceleration, record.contact)
    position, slope = record.position.copy(), np.ones_like(record.position)
    for j in range(model.joint_count):
        gain, offset, *bends = wrong[j]
        range_, zero = joints[j, at.RANGE], joints[j, at.AT_ZERO]
        q = record.position[:, j]
        error, rate = gain * (q - zero - 0.5 * range_) + offset, np.full_like(q, gain)
        for k, bend in enumerate(bends, start=1):
            wave = k * np.pi / range_
            error += bend * np.sin(wave * (q - zero))
            rate += bend * wave * np.cos(wave * (q - zero))
        position[:, j] -= error
        slope[:, j] -= rate
    speed = record.speed * slope
    return Motion(position, speed, np.gradient(speed, record.period, axis=0), record.contact)


def levels_along(model: Model, record: TorqueRecord) -> Floats:
    """Levels of Coulomb friction (k, n), N·m, along a record."""
    joints = np.ascontiguousarray(model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))
    chain = chain_body(np.ascontiguousarray(model.vector[: at.SHARED]), joints, model.flags)
    out, settings = np.zeros_like(record.position), np.zeros(at.SETTINGS, dtype=np.int64)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(model.machine))
    supplied.friction_loads(chain, record.position, joints, settings, out)
    return out


def _needed(chain: ChainArrays, motion: Motion) -> Floats:
    out = np.empty_like(motion.position)
    supplied.needed_torque(chain, motion.position, motion.speed, motion.acceleration, out)
    return out


def _gravity(chain: ChainArrays, motion: Motion) -> Floats:
    out = np.empty_like(motion.position)
    supplied.gravity_along(chain, motion.position, out)
    return out


def _twist_rate(through: Floats, joint: Floats, time: Floats) -> Floats:
    """Rate (k,) at which rotor and link move apart for a torque through a transmission that gives and has play."""
    twist = (joint[at.COMPLIANCE] + joint[at.CONTACT_COMPLIANCE]) * through
    if joint[at.GAP] > 0:
        soft = CONTACT_SHARE * float(np.sqrt(np.mean(through**2))) + 1e-12
        twist = twist + 0.5 * joint[at.GAP] * np.tanh(through / soft)
    return np.gradient(twist, time)


def joined(residuals: Sequence[Floats]) -> Floats:
    """All records below each other (Σm, n)."""
    return np.concatenate(list(residuals))
