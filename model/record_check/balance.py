"""Balances torques: do drive and motion agree as recorded, or would they in other units?

Friction is left free, since few files state it. Other effects of an arm are small beside a wrong unit, sign or column.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import savgol_coeffs, savgol_filter

from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.dynamics.recursive import gravity_along, inverse_dynamics_along
from model.machine_model.model import Model
from model.record_check.law import DEGREE
from model.record_check.readings import noise_of
from model.simulation.chain_of_model import chain_of

ORDER = 3
"""Degree of the polynomials that smooth a motion."""
NARROWEST, WIDEST = 5, 401
"""Samples of the smoothing."""
NOISE_SHARE = 0.1
"""Most noise of an acceleration, as a share of its root mean square."""
SLOWER = 3
"""Factor on the least smoothing that noise allows: flexible gears and backlash vibrate faster than a rigid arm
moves."""
MOST_ROWS = 4000
"""Samples of a record that are balanced: enough for factors of two."""
UNLIKE = 0.5
"""Share of the torque (root mean squares) that remains, above which drive and motion may not agree. Some rigs with
hidden effects leave as much, but no other unit or column explains their records."""
EXPLAINS = 0.25
"""Largest share of that mean square that may remain with another unit, sign or column for that to be the reason."""
CLEAR = 5.0
"""Number of deviations at which an estimate is significant, whatever the correlation of its noise."""
MOST_BEHIND = 1 / 8
"""Longest delay that is estimated, in widths of the smoothing. The fastest motion that passes it turns by 1 rad in that
time; the linear estimate of a delay is then wrong by a sixth."""
MOST_FRICTION = 5.0
"""Largest ratio of the drive's torque to that of weight and inertia: healthy rigs have up to 4.6."""
TURNED = 0.75
"""Least share of twice the torque of gravity in the remaining torque for gravity to count as reversed. A balance spring
that carries the whole arm gives 0.5."""
LEAST_REMOVED = 0.5
"""Least share of the mean square that reversing gravity must remove."""
LEAST_TORQUE = 0.1
"""Least torque of gravity on any joint, as a share of the drive's, from which records show its direction."""
OUT_OF_SCALE = 100.0
"""Ratio to the bodies' torque, or its inverse, above which a drive is in another unit: mA for A gives a thousand, and
healthy rigs 0.2 to 13."""


@dataclass(frozen=True)
class Motion:
    """Position and drive (k, n) of the modelled joints, and s between samples.

    speed: (k, n) where sensors measure it; position is then its integral.
    """

    position: Floats
    drive: Floats
    period: float
    step: Floats
    speed: Floats | None = None


@dataclass(frozen=True)
class Balance:
    """Mean squares by joint (n,): remaining torque, torque of the drive, torque of the motion, and the sum for the
    motion's two parts, weight and inertia, which may cancel."""

    left: Floats
    given: Floats
    needed: Floats
    parts: Floats
    turned: float
    """Share of the remaining mean square that reversing gravity removes; 0 if gravity is not the reason."""
    behind: Floats
    """(n,) samples by which the drive lags the motion that it causes; 0 where that is not significant, or longer than
    the smoothing can resolve. A drive that is held until the next sample leads by half of one."""

    @property
    def shares(self) -> Floats:
        """(n,) remaining mean square as a share of the larger of both torques; 0 where there is neither."""
        whole = np.maximum(self.given, self.needed)
        return np.asarray(np.where(whole > 0.0, self.left / np.where(whole > 0.0, whole, 1.0), 0.0))


def motion_of(trace: Trace, model: Model) -> Motion | None:
    """Returns the motion of a trace; None without drives, or with gaps that are too long to interpolate."""
    machine = model.machine
    if trace.drive is None or len(trace) < 2 * NARROWEST:
        return None
    columns = [trace.column(j) for j in machine.modelled_joints]
    period = float(np.median(np.diff(trace.time)))
    time = np.arange(trace.time[0], trace.time[-1] + 0.5 * period, period)[: 20 * MOST_ROWS]
    sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
    step = np.array([machine.joint(j).count for j in machine.modelled_joints])

    def even(signal: Floats) -> Floats:
        return np.stack([np.interp(time, trace.time, signal[:, c]) for c in columns], axis=1)

    by_speed = trace.velocity is not None and any(s is not None and s.measures == "velocity" for s in sensors)
    speed = even(trace.velocity) if by_speed and trace.velocity is not None else None
    return Motion(even(trace.position), even(trace.drive), period, step, speed)


def balance(model: Model, motion: Motion) -> Balance | None:
    """Returns the balance of a motion; None if no joint moves beyond the noise of its readings."""
    width = _width(motion)
    if width is None:
        return None
    torques = _torques(model, motion, width)
    given, needed, weight = torques.given, torques.needed, torques.weight
    found = [
        _left(given[:, j] - torques.braked[:, j], torques.speed[:, j], torques.rate[:, j], width)
        for j in range(given.shape[1])
    ]
    left, behind = np.array([one[0] for one in found]), np.array([one[1] for one in found])
    parts = np.mean(weight**2, axis=0) + np.mean((needed - weight) ** 2, axis=0)
    size, needs = (np.mean(torque**2, axis=0) for torque in (given, torques.braked))
    return Balance(left, size, needs, parts, _gravity_turned(given, torques.braked, weight), behind)


@dataclass(frozen=True)
class Factors:
    """Ratios of the drive's torque to the torque of the machine file's bodies: to all of it, to that for acceleration,
    and to their weight; and that of the motor's braking, with friction. None if not significant."""

    whole: float | None = None
    inertia: float | None = None
    weight: float | None = None
    braking: float | None = None


@dataclass(frozen=True)
class _Torques:
    """Torques (k, n) along a motion: of the drive, of the motion without and with back-EMF, of weight; the change of
    the drive's torque per sample; speeds and positions."""

    given: Floats
    needed: Floats
    braked: Floats
    weight: Floats
    rate: Floats
    speed: Floats
    position: Floats


def _torques(model: Model, motion: Motion, width: int) -> _Torques:
    joints = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    rows = slice(width // 2, len(motion.position) - width // 2, max(1, len(motion.position) // MOST_ROWS))

    def smooth(signal: Floats, order: int) -> Floats:
        whole = savgol_filter(signal, width, ORDER, deriv=order, delta=motion.period, axis=0)
        return np.ascontiguousarray(whole[rows])

    source, shift = (motion.position, 0) if motion.speed is None else (motion.speed, 1)
    position, speed = smooth(motion.position, 0), smooth(source, 1 - shift)
    acceleration, drive = smooth(source, 2 - shift), smooth(motion.drive, 0)
    gain = joints[:, at.GEAR] * joints[:, at.TORQUE_CONSTANT] / joints[:, at.RESISTANCE]
    given = gain * drive
    chain = chain_of(model)
    needed = inverse_dynamics_along(chain, position, speed, acceleration)
    braked = needed + gain * joints[:, at.GEAR] * joints[:, at.BACK_EMF] * speed
    rate = smooth(motion.drive, 1) * gain * motion.period
    return _Torques(given, needed, braked, gravity_along(chain, position), rate, speed, position)


def factors(model: Model, motion: Motion) -> list[Factors]:
    """Returns by joint the ratio of the drive's torque to that of the machine file's bodies.

    Friction of any size, back-EMF, a spring and a constant are free. They may be a large part of the torque and contain
    no information on units.
    """
    width = _width(motion)
    if width is None:
        return [Factors()] * motion.position.shape[1]
    torques = _torques(model, motion, width)
    return [_factors_of(torques, j, width) for j in range(motion.position.shape[1])]


def _factors_of(torques: _Torques, joint: int, width: int) -> Factors:
    given, needed, weight = (part[:, joint] for part in (torques.given, torques.needed, torques.weight))
    speed, position = torques.speed[:, joint], torques.position[:, joint]
    size = float(np.sqrt(np.mean(speed**2)))
    if size == 0.0:
        return Factors()
    braking = torques.braked[:, joint] - needed
    told = {"inertia": needed - weight, "weight": weight, "braking": braking}
    told = {name: part for name, part in told.items() if name == "inertia" or np.ptp(part) > 0.0}
    free = [np.tanh(speed / size / 0.05)] + ([position] if np.ptp(position) > 0.0 else [])
    (whole,) = _clear(given, [needed], [*free, speed], width)
    free += [] if "braking" in told else [speed]
    return Factors(whole, **dict(zip(told, _clear(given, [*told.values()], free, width), strict=True)))


def _clear(given: Floats, parts: list[Floats], free: list[Floats], width: int) -> list[float | None]:
    """Returns the factor of each part of a torque (k,), with free parts fitted too; None if not significant."""
    level = [column - column.mean() for column in (*parts, *free)]
    scales = [float(np.sqrt(np.mean(column**2))) for column in level]
    if 0.0 in scales:
        return [None] * len(parts)
    table = np.column_stack([column / scale for column, scale in zip(level, scales, strict=True)])
    line, _, rank, _ = np.linalg.lstsq(table, given - given.mean(), rcond=None)
    if rank < table.shape[1]:
        return [None] * len(parts)
    spread = float(np.mean((given - given.mean() - table @ line) ** 2)) * width
    triangle = np.linalg.inv(np.linalg.qr(table, mode="r"))  # the squared norms of its rows are the diagonal of (AᵀA)⁻¹
    deviations = np.sqrt(spread * np.sum(triangle**2, axis=1))
    return [float(line[k]) / scales[k] if line[k] > CLEAR * deviations[k] else None for k in range(len(parts))]


def likelier(model: Model, motion: Motion, joint: int | None, ways: Sequence[str]) -> str | None:
    """Returns the key of `ways` that best explains a balance which does not hold as recorded, or None.

    None means that the balance holds, or that none of the ways explains it. A way is rejected if a joint whose drive
    and motion agree as recorded no longer does: its torque depends on how the others move, and all share the same
    times.

    Args:
        joint: index of the joint whose columns are changed; None: of all.
        ways: keys of WAYS.
    """
    found = balance(model, motion)
    if found is None:
        return None
    whole = _total(found, joint)
    if not whole > UNLIKE**2:
        return None
    sound = found.shares <= UNLIKE**2
    left = {way: _left_by(model, changed, joint, sound) for way, changed in _changed(motion, joint, ways)}
    best = min(left, key=lambda way: left[way], default=None)
    return best if best is not None and left[best] < EXPLAINS * whole else None


def _total(found: Balance, joint: int | None) -> float:
    return float(found.shares.mean() if joint is None else found.shares[joint])


def _left_by(model: Model, changed: Motion, joint: int | None, sound: NDArray[np.bool_]) -> float:
    """Returns the share that remains with a changed motion; infinite if the change is implausible.

    That is so if nearly all of the drive would go into friction, which fits any drive along the motion; if friction
    alone would explain the motion as well; or if a joint that was healthy (n,) no longer is.
    """
    found, idle = balance(model, changed), balance(model, replace(changed, drive=np.zeros_like(changed.drive)))
    if found is None or idle is None or (found.shares[sound] > UNLIKE**2).any():
        return np.inf
    left = _total(found, joint)
    given, needed = (float(np.sum(one if joint is None else one[joint])) for one in (found.given, found.needed))
    return np.inf if given > MOST_FRICTION**2 * needed or left > EXPLAINS * _total(idle, joint) else left


def _changed(motion: Motion, joint: int | None, ways: Sequence[str]) -> Iterator[tuple[str, Motion]]:
    columns = list(range(motion.position.shape[1])) if joint is None else [joint]
    for way in ways:
        yield way, WAYS[way](motion, columns)


def _scaled(signal: str, factor: float) -> Callable[[Motion, list[int]], Motion]:
    def changed(motion: Motion, columns: list[int]) -> Motion:
        whole = getattr(motion, signal)
        if whole is None:
            return motion
        whole = whole.copy()
        whole[:, columns] *= factor
        return replace(motion, **{signal: whole})

    return changed


def _degrees(motion: Motion, columns: list[int]) -> Motion:
    return _scaled("position", DEGREE)(_scaled("speed", DEGREE)(motion, columns), columns)


def _slower(factor: float) -> Callable[[Motion, list[int]], Motion]:
    return lambda motion, _columns: replace(motion, period=factor * motion.period)


def _exchanged(motion: Motion, columns: list[int]) -> Motion:
    position, drive = motion.position.copy(), motion.drive.copy()
    position[:, columns], drive[:, columns] = motion.drive[:, columns], motion.position[:, columns]
    return replace(motion, position=position, drive=drive, speed=None)


WAYS: dict[str, Callable[[Motion, list[int]], Motion]] = {
    "degrees": _degrees,
    "thousandths": _scaled("drive", 1e-3),
    "thousands": _scaled("drive", 1e3),
    "drive-sign": _scaled("drive", -1.0),
    "milliseconds": _slower(1e-3),
    "seconds": _slower(1e3),
    "position-drive": _exchanged,
}
"""Changes of a record, or its machine file, that may make its balance hold."""
OF_ALL = frozenset(["milliseconds", "seconds"])
"""Those that concern the whole record."""


def _gravity_turned(given: Floats, needed: Floats, weight: Floats) -> float:
    """Returns the share of the mean square that reversing gravity removes; 0 if gravity is not the reason."""
    sizes = np.sqrt(np.mean(given**2, axis=0))
    if not (sizes > 0.0).all():
        return 0.0
    left, change = (needed - given) / sizes, -2.0 * weight / sizes
    if not np.mean(change**2, axis=0).max() > (2 * LEAST_TORQUE) ** 2:
        return 0.0
    share = -float(np.sum(left * change) / np.sum(change**2))
    removed = 1.0 - float(np.sum((left + change) ** 2) / np.sum(left**2))
    return removed if share > TURNED and removed > LEAST_REMOVED else 0.0


def _left(torque: Floats, speed: Floats, rate: Floats, width: int) -> tuple[float, float]:
    """Returns the mean square of a torque (k,) after fitting a constant and any friction, and the samples that the
    drive lags.

    Args:
        rate: (k,) change of the drive's torque per sample.
        width: samples over which they are smoothed; one in as many is independent.
    """
    size = float(np.sqrt(np.mean(speed**2)))
    if size == 0.0:
        return float(np.var(torque)), 0.0
    along = speed / size
    columns = np.column_stack([np.tanh(along / 0.05), along])
    columns -= columns.mean(axis=0)
    level = torque - torque.mean()
    left = float(nnls(columns, level)[1] ** 2 / len(torque))
    columns = np.column_stack([columns, rate - rate.mean()])
    line, _, rank, _ = np.linalg.lstsq(columns, level, rcond=None)
    if rank < columns.shape[1]:
        return left, 0.0
    spread = float(np.mean((level - columns @ line) ** 2)) * width
    deviation = float(np.sqrt(spread * np.linalg.inv(columns.T @ columns)[2, 2]))
    return left, float(-line[2]) if CLEAR * deviation < abs(line[2]) < MOST_BEHIND * width else 0.0


def _width(motion: Motion) -> int | None:
    """Returns the narrowest smoothing, in samples, with little noise of acceleration on every moving joint."""
    order = 2 if motion.speed is None else 1
    source = motion.position if motion.speed is None else motion.speed
    noise = np.array([noise_of(source[:, j], motion.step[j] if order == 2 else 0.0) for j in range(source.shape[1])])
    width = NARROWEST
    while width <= min(WIDEST, len(source) // 4):
        weight = float(np.linalg.norm(savgol_coeffs(width, ORDER, deriv=order)))
        size = np.sqrt(np.mean(savgol_filter(source, width, ORDER, deriv=order, axis=0) ** 2, axis=0))
        moving = size > 3 * weight * noise
        if moving.any() and (weight * noise[moving] < NOISE_SHARE * size[moving]).all():
            return min(SLOWER * width, (len(source) // 4) | 1)
        width = 2 * (width * 5 // 8) + 1 if width > NARROWEST else 7
    return None
