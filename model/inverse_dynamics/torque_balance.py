"""Computes the motors' torque that a recorded motion needs − the torque that was applied, for any parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from model import layout as at
from model.arrays import Floats
from model.drives.piecewise import EDGE
from model.fitting.phases import turned_pairs
from model.fitting.unknowns import Unknown
from model.inverse_dynamics import supplied_torque as kernel
from model.inverse_dynamics.drive_timing import samples_late
from model.inverse_dynamics.friction_at_rest import (
    RestingFriction,
    follow_limits,
    friction_at_rest,
    held_friction,
    subtract_friction,
)
from model.inverse_dynamics.link_motion import SENSOR_COLUMNS, LinkMotion, link_motion
from model.inverse_dynamics.needed_torque import NeededTorque
from model.inverse_dynamics.readings import derivative
from model.inverse_dynamics.recorded_motion import RecordedMotion, holds_drive_between_samples
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm, nominal_vector
from model.simulation.bodies import chain_body
from model.simulation.own_table import own_table

NOT_IN_TORQUES = {
    "wrong_gain": "acts before the drive that is recorded",
    "lost_set_points": "acts before the drive that is recorded",
    "stiction": "shows only at breakaway, which low-passed torques do not resolve",
}
"""Effects that low-passed torques of the recorded drive do not show, and why. All others are included."""
DIFFERENCE = 1e-6
"""Step of the finite differences, as a share of a parameter's natural size: torques are smooth or piecewise linear. A
step of a thousandth moved reversals across a corner of the friction, at other samples for each parameter. Masses that
cancel each other then no longer did, and a fit could not move along their direction."""
CONTACT_SHARE = 0.02
"""Torque through a transmission within which backlash changes sides, as a share of the torque's root mean square."""
THRESHOLD = "amplifier_threshold"
"""The effect whose parameter makes the residual jump."""
LEAST_KEPT = 0.05
"""Least share of a torque that gears transmit: two losses together may exceed one."""
GEOMETRIES = 3
"""Geometries whose torques are kept: of the fit, of a parameter moved for a derivative, and of a candidate."""
BODY_COLUMNS = (*range(at.A, at.SHIFT + 1), at.ROTOR_INERTIA, at.GEAR, at.PRISMATIC, at.SHAPE)
FRICTION_COLUMNS = (at.COULOMB, at.COULOMB_ARM, at.GRAVITY_SHARE)


@dataclass(frozen=True)
class _Column:
    """The residual of one joint along one record, with what it was computed from.

    given: (5, k) torque, factor and friction at rest. left: (m, 1). taken: (k, 1) friction at rest.
    """

    given: Floats
    left: Floats
    taken: Floats
    friction: RestingFriction


@dataclass
class TorqueBalance:
    """Residual torques of records for one structure of model, at compared samples: one array (m, n) per record.

    Parts that do not depend on the parameters that changed since the last call are not computed again.
    """

    model: Model
    records: tuple[RecordedMotion, ...]
    _kept: dict[str, tuple[bytes, list[Any]]] = field(default_factory=dict, repr=False)
    _geometries: dict[int, dict[bytes, NeededTorque]] = field(default_factory=dict, repr=False)
    _last: dict[tuple[int, int], list[_Column]] = field(default_factory=dict, repr=False)
    difference: float = DIFFERENCE
    """Step of the finite differences, as a share of a parameter's natural size."""

    def residual(self, values: Mapping[str, float]) -> list[Floats]:
        """Returns the motors' torque that the motion needs − the torque applied, N·m (N), low-passed, at compared
        samples.

        The drive is predicted from the motion, not the motion from the drive. Otherwise an effect that weakens the
        drive would reduce the residual by itself. For the same reason the residual is a torque of the drive as the
        machine file states it, whatever the fitted resistance, its warming, magnet and gear ratio.

        values: of the model's parameters, and of `timing_unknowns` and `phase_unknowns`, by name.
        """
        return self._residual(values, None)

    def _residual(self, values: Mapping[str, float], near: Sequence[Sequence[_Column]] | None) -> list[Floats]:
        """Returns the residual. near: columns by record and joint, whose friction at rest is kept; None to find it."""
        vector, late = self._vector(values), samples_late(self.model, values)
        joints = _joints_of(vector, self.model)
        chain = chain_body(np.ascontiguousarray(vector[: at.SHARED]), joints, self.model.flags)
        bodies = self.model.flags.tobytes() + vector[: at.SHARED].tobytes() + joints[:, list(BODY_COLUMNS)].tobytes()
        sensors = joints[:, list(SENSOR_COLUMNS)].tobytes()
        rubbing = joints[:, list(FRICTION_COLUMNS)].tobytes()
        motions = self._cached("motion", sensors, lambda i: link_motion(self.records[i], joints))
        needed = self._cached("needed", sensors + bodies, lambda i: self._needed(sensors, chain, motions, i))
        levels = self._cached(
            "levels", sensors + bodies + rubbing, lambda i: _levels(self.model, chain, motions[i].position, joints)
        )
        gravity = levels
        if self._own.shape[1] > 0:
            gravity = self._cached("gravity", sensors + bodies, lambda i: _gravity(chain, motions[i]))
        result = []
        for i, record in enumerate(self.records):
            motion = motions[i]
            driven = kernel.DrivenMotion(
                record.time,
                motion.position,
                motion.speed,
                motion.contact,
                motion.speed,
                self._volts(i, vector, joints, late),
                levels[i],
                gravity[i],
            )
            own = self._of_record(i, values, joints)
            torque, rise = self._missing(driven, motion.acceleration, needed[i], own)
            told = (1.0 + rise) * self._told_per_torque(joints)
            friction = friction_at_rest(levels[i], motion, joints)
            result.append(self._compared(i, torque, told, friction, None if near is None else near[i]))
        return result

    def _compared(
        self,
        index: int,
        torque: Floats,
        told: Floats,
        friction: RestingFriction,
        near: Sequence[_Column] | None,
    ) -> Floats:
        """Returns (m, n) from a torque (k, n): without friction at rest, and scaled by factors `told` (k, n).

        It computes only joints whose torque or friction differs from both of the last two distinct results: a
        derivative by a parameter of one joint changes only that joint.
        """
        columns = []
        for j, record in enumerate(self.records[index].by_joint):
            given, own = np.stack([torque[:, j], told[:, j], *(part[:, j] for part in friction)]), friction.of_joint(j)
            known = self._last.setdefault((index, j), []) if near is None else [near[j]]
            found = next((one for one in known if np.array_equal(one.given, given)), None)
            if found is None:
                whole = torque[:, j : j + 1]
                if near is None:
                    taken = held_friction(whole, own, record)
                else:
                    taken = follow_limits(near[j].taken, near[j].friction, own)
                moving = subtract_friction(whole, own, record, taken) * told[:, j : j + 1]
                found = _Column(given, record.subtract_unknown(record.compared(moving)), taken, own)
            if near is None:
                known[:] = [found, *(one for one in known if one is not found)][:2]
            columns.append(found.left)
        return np.concatenate(columns, axis=1)

    def of_model(self, model: Model) -> TorqueBalance:
        """Returns the balance of another model of the same machine, which shares the cache."""
        return replace(self, model=model)

    def told_per_torque(self, values: Mapping[str, float]) -> Floats:
        """Returns the residual (n,) per unit of torque at each joint: not 1 if the motor's parameters differ from the
        file's."""
        return self._told_per_torque(_joints_of(self._vector(values), self.model))

    def slopes(
        self, values: Mapping[str, float], unknowns: Sequence[Unknown], keep_friction: bool = True
    ) -> list[list[Floats]]:
        """Returns the derivatives (m, n) of every record's residual by each unknown: differences towards the inside of
        its bounds.

        A threshold switches from sample to sample; its derivative is the difference over a smooth edge.

        keep_friction: whether friction at rest stays as it is, within its limits. It leaves no less then than if it
        followed, so that a step of a fit leads no farther than friction can follow. Otherwise it takes all of a change
        that it can, which is what the records tell.
        """
        residual = self.residual(values)
        near = (
            None
            if not keep_friction
            else [[self._last[i, j][0] for j in range(len(r.by_joint))] for i, r in enumerate(self.records)]
        )
        return [self._slope(values, residual, near, u) for u in unknowns]

    def _slope(
        self,
        values: Mapping[str, float],
        residual: Sequence[Floats],
        near: Sequence[Sequence[_Column]] | None,
        unknown: Unknown,
    ) -> list[Floats]:
        if unknown.parameter.effect == THRESHOLD and values[unknown.name] > 0:
            half = 0.5 * EDGE * values[unknown.name]
            sides = (self._residual({**values, unknown.name: values[unknown.name] + s * half}, near) for s in (1, -1))
            return [(above - below) / (2 * half) for above, below in zip(*sides, strict=True)]
        step = self.difference * unknown.scale
        if values[unknown.name] + step > unknown.high:
            step = -step
        moved = self._residual({**values, unknown.name: values[unknown.name] + step}, near)
        return [(after - before) / step for after, before in zip(moved, residual, strict=True)]

    def supplied_by_drive(self) -> list[Floats]:
        """Returns the torque of the drive alone (m, n), as recorded, of motors at standstill; residuals are given as
        its share."""
        return [record.compared(record.drive * self._stated_gain) for record in self.records]

    def _told_per_torque(self, joints: Floats) -> Floats:
        return np.asarray(self._stated_gain / _torque_per_volt(joints))

    @cached_property
    def _stated_gain(self) -> Floats:
        """Returns the torque of a motor at standstill per unit of drive (n,), from the machine file."""
        return _torque_per_volt(_joints_of(nominal_vector(self.model.machine), self.model))

    @cached_property
    def _own(self) -> NDArray[np.int64]:
        return own_table(self.model, np.float64)

    def _vector(self, values: Mapping[str, float]) -> Floats:
        """Returns the model's flat vector with other values of some parameters."""
        vector = self.model.vector.copy()
        for name, value in values.items():
            if name in self.model.by_name:  # the other names belong to the records
                vector[list(self.model.parameter(name).slots)] = value
        return vector

    def _of_record(self, index: int, values: Mapping[str, float], joints: Floats) -> Floats:
        """Returns the joints' numbers with the phases that disturbances have in a record."""
        if not (turned := turned_pairs(self.model, values, index)):
            return joints
        own = joints.copy()
        for parameter, value in turned:
            for slot in parameter.slots:
                own.ravel()[slot - at.SHARED] = value
        return own

    def _cached(self, what: str, key: bytes, compute: Callable[[int], Any]) -> list[Any]:
        """Returns one result per record, computed again only if `key` has changed since the last call."""
        kept = self._kept.get(what)
        if kept is None or kept[0] != key:
            kept = key, [compute(i) for i in range(len(self.records))]
            self._kept[what] = kept
        return kept[1]

    def _needed(self, sensors: bytes, chain: ChainArrays, motions: Sequence[LinkMotion], index: int) -> Floats:
        """Returns the torque (k, n) that the links' motion needs.

        What is known of a geometry is kept until others were used since. A geometry that was asked for once goes first,
        as a derivative by a sensor's parameter asks for it.
        """
        key = sensors + b"".join(part.tobytes() for part in (chain.prismatic, chain.geometry, chain.gravity))
        known = self._geometries.setdefault(index, {})
        found = known.pop(key, None) or NeededTorque(motions[index])
        if len(known) == GEOMETRIES:
            del known[next((k for k, one in known.items() if one.asked == 1), next(iter(known)))]
        known[key] = found
        return found.of(chain)

    def _volts(self, index: int, vector: Floats, joints: Floats, samples: Floats) -> Floats:
        """Returns volts at the motors at the grid's times, after delay, threshold and limit; `_lost_in_dead_zone`
        follows.

        samples: (n,) by which drives are late.
        """
        delays = vector[at.DELAY] + joints[:, at.EXTRA_DELAY]
        if holds_drive_between_samples(self.model.machine):
            delays = delays + 0.5 * vector[at.PERIOD]
        limit, threshold = joints[:, at.SUPPLY], joints[:, at.THRESHOLD]
        return self._cached(
            "drive",
            delays.tobytes() + samples.tobytes() + limit.tobytes() + threshold.tobytes(),
            lambda i: np.ascontiguousarray(
                self.records[i].driven(delays + samples * self.records[i].sampled, limit, threshold), dtype=np.float64
            ),
        )[index]

    def _missing(
        self, driven: kernel.DrivenMotion, acceleration: Floats, needed: Floats, joints: Floats
    ) -> tuple[Floats, Floats]:
        """Returns the motors' torque that the motion needs − the torque applied (k, n), and the relative rise (k, n) of
        their windings' resistance."""
        flags, speed, time = self.model.flags, driven.speed, driven.time
        numbers = kernel.JointNumbers(joints, flags, self._own)
        motor, other, rise = (np.empty_like(needed) for _ in range(3))
        kernel.supplied_torque(driven, numbers, motor, other, rise)
        asked = needed - other
        if flexible := [j for j in range(len(flags)) if flags[j] & at.HAS_FLEXIBILITY]:
            rotor_speed, needed = speed.copy(), needed.copy()
            for j in flexible:
                extra = _twist_rate(asked[:, j], joints[j], time)
                rotor_speed[:, j] += extra
                inertia = joints[j, at.ROTOR_INERTIA] * joints[j, at.GEAR] ** 2
                needed[:, j] += inertia * (acceleration[:, j] + derivative(extra, time[1] - time[0]))
            kernel.supplied_torque(driven._replace(rotor_speed=rotor_speed), numbers, motor, other, rise)
            asked = needed - other
        asked = _before_losses(asked, driven.contact, joints)
        return asked - motor + _lost_in_dead_zone(asked, speed, joints), rise


def levels_along(model: Model, record: RecordedMotion) -> Floats:
    """Returns levels of Coulomb friction (k, n), N·m, along a record."""
    joints = _joints_of(model.vector, model)
    chain = chain_body(np.ascontiguousarray(model.vector[: at.SHARED]), joints, model.flags)
    return _levels(model, chain, record.position, joints)


def _joints_of(vector: Floats, model: Model) -> Floats:
    """Returns the joints' part (n, PER_JOINT) of a model's vector."""
    return np.ascontiguousarray(vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))


def _torque_per_volt(joints: Floats) -> Floats:
    """Returns the torque of a motor at standstill per volt, or per unit of a plain drive (n,)."""
    constant = joints[:, at.TORQUE_CONSTANT] * (1 - joints[:, at.FLUX_LOSS])
    return np.asarray(joints[:, at.GEAR] * constant / joints[:, at.RESISTANCE])


def _levels(model: Model, chain: ChainArrays, position: Floats, joints: Floats) -> Floats:
    out, settings = np.zeros_like(position) + joints[:, at.COULOMB], np.zeros(at.SETTINGS, dtype=np.int64)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(model.machine))
    if joints[:, [at.COULOMB_ARM, at.GRAVITY_SHARE]].any():
        kernel.friction_levels(chain, position, joints, settings, out)
    return out


def _gravity(chain: ChainArrays, motion: LinkMotion) -> Floats:
    out = np.empty_like(motion.position)
    kernel.gravity_along(chain, motion.position, out)
    return out


def _before_losses(asked: Floats, contact: Floats, joints: Floats) -> Floats:
    """Returns the torque (k, n) at the input of gears with output `asked` (k, n).

    Gears lose a share; if the link drives the motor, the loss changes sign.
    """
    loss, difference = joints[:, at.GEAR_LOSS], joints[:, at.GEAR_LOSS_DIRECTION]
    if not (loss.any() or difference.any()):
        return asked
    along = contact * np.sign(asked)
    # at a reversal, contact is a mean of both directions, and so is a loss in one direction only
    share = loss * along + 0.5 * difference * (1 + np.sign(difference) * along)
    return np.asarray(asked / np.maximum(1 - share, LEAST_KEPT))


def _lost_in_dead_zone(asked: Floats, speed: Floats, joints: Floats) -> Floats:
    """Returns the torque (k, n) that the amplifier's dead zone removes, with the sign of the volts that the motor
    needs."""
    width = joints[:, at.DEAD_ZONE]
    if not width.any():
        return np.zeros_like(asked)
    gain = _torque_per_volt(joints)
    back_emf = joints[:, at.GEAR] * (1 - joints[:, at.FLUX_LOSS]) * joints[:, at.BACK_EMF]
    volts = asked / gain + back_emf * speed
    soft = CONTACT_SHARE * np.sqrt(np.mean(volts**2, axis=0)) + 1e-12
    return np.asarray(gain * width * np.tanh(volts / soft))


def _twist_rate(through: Floats, joint: Floats, time: Floats) -> Floats:
    """Returns the rate (k,) of the angle between rotor and link for a torque through compliance and backlash.

    A flexible gear with damping follows the torque with a lag; a contact follows above every cutoff.
    """
    period = time[1] - time[0]
    twist = joint[at.COMPLIANCE] * _follow_with_lag(
        through, joint[at.COMPLIANCE] * joint[at.TRANSMISSION_DAMPING], period
    )
    twist = twist + joint[at.CONTACT_COMPLIANCE] * through
    if joint[at.GAP] > 0:
        soft = CONTACT_SHARE * float(np.sqrt(np.mean(through**2))) + 1e-12
        twist = twist + 0.5 * joint[at.GAP] * np.tanh(through / soft)
    return derivative(twist, period)


def _follow_with_lag(signal: Floats, time_constant: float, period: float) -> Floats:
    """Applies a first-order lag to a signal (k,), exact if the signal is linear between its samples."""
    if time_constant <= 0.0:
        return signal
    kept = math.exp(-period / time_constant)
    new = 1.0 - (1.0 - kept) * time_constant / period
    followed, _ = lfilter([new, 1.0 - kept - new], [1.0, -kept], signal, zi=[(1.0 - new) * signal[0]])
    return np.asarray(followed)
