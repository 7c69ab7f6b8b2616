"""Torque that a recorded motion needs of the motors less torque that they were driven with, for any parameters."""

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
from model.fitting.unknowns import Unknown
from model.inverse_dynamics import supplied_torque as kernel
from model.inverse_dynamics.drive_timing import samples_late
from model.inverse_dynamics.friction_at_rest import RestingFriction, friction_at_rest, subtract_held
from model.inverse_dynamics.link_motion import SENSOR_COLUMNS, LinkMotion, link_motion
from model.inverse_dynamics.needed_torque import NeededTorque
from model.inverse_dynamics.recorded_motion import RecordedMotion, holds_drive_between_samples
from model.inverse_dynamics.smoothing import derivative
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm, nominal_vector
from model.simulation.bodies import chain_body
from model.simulation.own_table import own_table

NOT_IN_TORQUES = {
    "wrong_gain": "acts before the drive that is recorded",
    "lost_set_points": "acts before the drive that is recorded",
    "stiction": "shows in the moment of breaking away, which low-passed torques do not resolve",
}
"""Effects that low-passed torques of the recorded drive do not show, and why. All others take part."""
DIFFERENCE = 1e-6
"""Step of the finite differences, as a share of a parameter's natural size: torques are smooth or piecewise linear. A
step of a thousandth took joints that turn over a corner of their friction, each parameter over others; masses that
cancel each other then did not, and a fit could not move along them."""
CONTACT_SHARE = 0.02
"""Torque through a transmission over which play changes sides, as a share of the torque's root mean square."""
THRESHOLD = "amplifier_threshold"
"""The effect whose parameter makes the residual jump."""
LEAST_KEPT = 0.05
"""Least share of a torque that gears are taken to pass on: two losses together may exceed one."""
GEOMETRIES = 3
"""Geometries of which torques are kept: of the fit, of a number moved for a derivative, and of a candidate."""
BODY_COLUMNS = (*range(at.A, at.SHIFT + 1), at.ROTOR_INERTIA, at.GEAR, at.PRISMATIC, at.SHAPE)
FRICTION_COLUMNS = (at.COULOMB, at.COULOMB_ARM, at.GRAVITY_SHARE)


@dataclass
class TorqueBalance:
    """Residual torques of records for one structure of model, compared samples only: one array (m, n) a record.

    What does not depend on the parameters that changed since the last call is not computed again.
    """

    model: Model
    records: tuple[RecordedMotion, ...]
    _kept: dict[str, tuple[bytes, list[Any]]] = field(default_factory=dict, repr=False)
    _geometries: dict[int, dict[bytes, NeededTorque]] = field(default_factory=dict, repr=False)
    _last: dict[tuple[int, int], list[tuple[Floats, Floats]]] = field(default_factory=dict, repr=False)
    difference: float = DIFFERENCE
    """Step of the finite differences, as a share of a parameter's natural size."""

    def residual(self, values: Mapping[str, float]) -> list[Floats]:
        """Torque needed of the motors less torque that they were driven with, N·m (N), low-passed, compared samples.

        It is the drive that is predicted from the motion, and not the motion from the drive: an effect that makes the
        drive act less would otherwise make the residual smaller by itself. For the same reason it is told as a torque
        of the drive that the machine file states, whatever the fitted resistance, its warming, magnet and gear ratio
        make of a volt.

        values: of the model's parameters, and of `drive_timing.timing_unknowns`, by name.
        """
        vector, late = self._vector(values), samples_late(self.model, values)
        joints = _joints_of(vector, self.model)
        chain = chain_body(np.ascontiguousarray(vector[: at.SHARED]), joints, self.model.flags)
        bodies = self.model.flags.tobytes() + vector[: at.SHARED].tobytes() + joints[:, list(BODY_COLUMNS)].tobytes()
        sensors = joints[:, list(SENSOR_COLUMNS)].tobytes()
        friction = joints[:, list(FRICTION_COLUMNS)].tobytes()
        motions = self._cached("motion", sensors, lambda i: link_motion(self.records[i], joints))
        needed = self._cached("needed", sensors + bodies, lambda i: self._needed(sensors, chain, motions, i))
        levels = self._cached(
            "levels", sensors + bodies + friction, lambda i: _levels(self.model, chain, motions[i].position, joints)
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
            torque, rise = self._missing(driven, motion.acceleration, needed[i], joints)
            told = (1.0 + rise) * self._told_per_torque(joints)
            result.append(self._compared(i, torque, told, friction_at_rest(levels[i], motion, joints)))
        return result

    def _compared(self, index: int, torque: Floats, told: Floats, friction: RestingFriction) -> Floats:
        """What is compared (m, n) of a torque (k, n) with what friction holds taken out, told with factors (k, n).

        Only the joints are computed whose torque or friction is another one than in both of the last two results that
        were not the same: a derivative by a number of one joint changes that joint.
        """
        columns = []
        for j, record in enumerate(self.records[index].by_joint):
            given = np.stack([torque[:, j], told[:, j], *(part[:, j] for part in friction)])
            last = self._last.setdefault((index, j), [])
            found = next((done for key, done in last if np.array_equal(key, given)), None)
            if found is None:
                held = subtract_held(torque[:, j : j + 1], friction.of_joint(j), record)
                found = record.subtract_unknown(record.compared(held * told[:, j : j + 1]))
                last[:] = [(given, found), *last[:1]]
            columns.append(found)
        return np.concatenate(columns, axis=1)

    def of_model(self, model: Model) -> TorqueBalance:
        """The balance of another model of the same machine, which shares what is kept."""
        return replace(self, model=model)

    def told_per_torque(self, values: Mapping[str, float]) -> Floats:
        """What `residual` tells (n,) for a unit of torque at each joint: not 1 where the motor's numbers are not the
        machine file's."""
        return self._told_per_torque(_joints_of(self._vector(values), self.model))

    def slope(self, values: Mapping[str, float], residual: Sequence[Floats], unknown: Unknown) -> list[Floats]:
        """Derivative (m, n) of every record's residual by one unknown: a difference towards the inside of its bounds.

        A threshold jumps from sample to sample; its derivative is the difference over an edge about it.

        residual: what `residual` gives for the same values.
        """
        if unknown.parameter.effect == THRESHOLD and values[unknown.name] > 0:
            half = 0.5 * EDGE * values[unknown.name]
            sides = (self.residual({**values, unknown.name: values[unknown.name] + s * half}) for s in (1, -1))
            return [(above - below) / (2 * half) for above, below in zip(*sides, strict=True)]
        step = self.difference * unknown.scale
        if values[unknown.name] + step > unknown.high:
            step = -step
        moved = self.residual({**values, unknown.name: values[unknown.name] + step})
        return [(after - before) / step for after, before in zip(moved, residual, strict=True)]

    def supplied_by_drive(self) -> list[Floats]:
        """Torque of the drive alone (m, n), as recorded, of motors at standstill: what residuals are shares of."""
        return [record.compared(record.drive * self._stated_gain) for record in self.records]

    def _told_per_torque(self, joints: Floats) -> Floats:
        return np.asarray(self._stated_gain / _torque_per_volt(joints))

    @cached_property
    def _stated_gain(self) -> Floats:
        """Torque of a motor at standstill for a unit of drive (n,), by the machine file."""
        return _torque_per_volt(_joints_of(nominal_vector(self.model.machine), self.model))

    @cached_property
    def _own(self) -> NDArray[np.int64]:
        return own_table(self.model, np.float64)

    def _vector(self, values: Mapping[str, float]) -> Floats:
        """The model's flat vector with other values of some parameters."""
        vector = self.model.vector.copy()
        for name, value in values.items():
            if name in self.model.by_name:  # the others are of the records
                vector[list(self.model.parameter(name).slots)] = value
        return vector

    def _cached(self, what: str, key: bytes, compute: Callable[[int], Any]) -> list[Any]:
        """One result a record, computed again only where `key` has changed since the last call."""
        kept = self._kept.get(what)
        if kept is None or kept[0] != key:
            kept = key, [compute(i) for i in range(len(self.records))]
            self._kept[what] = kept
        return kept[1]

    def _needed(self, sensors: bytes, chain: ChainArrays, motions: Sequence[LinkMotion], index: int) -> Floats:
        """Torque (k, n) that the links' motion needs. What is known of a geometry is kept until others were used since;
        one of a single question goes first, as a derivative by a sensor's number asks it."""
        key = sensors + b"".join(part.tobytes() for part in (chain.prismatic, chain.geometry, chain.gravity))
        known = self._geometries.setdefault(index, {})
        found = known.pop(key, None) or NeededTorque(motions[index])
        if len(known) == GEOMETRIES:
            del known[next((k for k, one in known.items() if one.asked == 1), next(iter(known)))]
        known[key] = found
        return found.of(chain)

    def _volts(self, index: int, vector: Floats, joints: Floats, samples: Floats) -> Floats:
        """Volts at the motors at the grid's times, after delay, threshold and limit; `_lost_in_dead_zone` has what a
        zone takes.

        samples: (n,) that drives are late by.
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
        """Torque needed of the motors less torque that they were driven with (k, n), and the relative rise (k, n) of
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
    """Levels of Coulomb friction (k, n), N·m, along a record."""
    joints = _joints_of(model.vector, model)
    chain = chain_body(np.ascontiguousarray(model.vector[: at.SHARED]), joints, model.flags)
    return _levels(model, chain, record.position, joints)


def _joints_of(vector: Floats, model: Model) -> Floats:
    """The joints' part (n, PER_JOINT) of a model's vector."""
    return np.ascontiguousarray(vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))


def _torque_per_volt(joints: Floats) -> Floats:
    """Torque of a motor at standstill for a volt, or for a unit of a plain drive (n,)."""
    constant = joints[:, at.TORQUE_CONSTANT] * (1 - joints[:, at.FLUX_LOSS])
    return np.asarray(joints[:, at.GEAR] * constant / joints[:, at.RESISTANCE])


def _levels(model: Model, chain: ChainArrays, position: Floats, joints: Floats) -> Floats:
    out, settings = np.zeros_like(position), np.zeros(at.SETTINGS, dtype=np.int64)
    settings[at.PUBLISHED_LOADS] = int(is_rod_arm(model.machine))
    if joints[:, list(FRICTION_COLUMNS)].any():
        kernel.friction_levels(chain, position, joints, settings, out)
    return out


def _gravity(chain: ChainArrays, motion: LinkMotion) -> Floats:
    out = np.empty_like(motion.position)
    kernel.gravity_along(chain, motion.position, out)
    return out


def _before_losses(asked: Floats, contact: Floats, joints: Floats) -> Floats:
    """Torque (k, n) into gears that give `asked` (k, n): they lose a share, or take it from a link that drives."""
    loss, difference = joints[:, at.GEAR_LOSS], joints[:, at.GEAR_LOSS_DIRECTION]
    if not (loss.any() or difference.any()):
        return asked
    along = contact * np.sign(asked)
    # where motion turns, contact is a mean of both directions: so is what is lost one way only
    share = loss * along + 0.5 * difference * (1 + np.sign(difference) * along)
    return np.asarray(asked / np.maximum(1 - share, LEAST_KEPT))


def _lost_in_dead_zone(asked: Floats, speed: Floats, joints: Floats) -> Floats:
    """Torque (k, n) that the amplifier's dead zone takes away, of the sign of the volts that the motor needs."""
    width = joints[:, at.DEAD_ZONE]
    if not width.any():
        return np.zeros_like(asked)
    gain = _torque_per_volt(joints)
    back_emf = joints[:, at.GEAR] * (1 - joints[:, at.FLUX_LOSS]) * joints[:, at.BACK_EMF]
    volts = asked / gain + back_emf * speed
    soft = CONTACT_SHARE * np.sqrt(np.mean(volts**2, axis=0)) + 1e-12
    return np.asarray(gain * width * np.tanh(volts / soft))


def _twist_rate(through: Floats, joint: Floats, time: Floats) -> Floats:
    """Rate (k,) at which rotor and link move apart for a torque through a transmission with compliance and play. A gear
    that gives and damps follows the torque late; a contact does so far above every cutoff."""
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
    """What follows a signal (k,) with a first-order lag, exactly for one that is straight between its samples."""
    if time_constant <= 0.0:
        return signal
    kept = math.exp(-period / time_constant)
    new = 1.0 - (1.0 - kept) * time_constant / period
    followed, _ = lfilter([new, 1.0 - kept - new], [1.0, -kept], signal, zi=[(1.0 - new) * signal[0]])
    return np.asarray(followed)
