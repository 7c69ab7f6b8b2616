"""Which effects may explain residual torques, on which joints, and from which values their parameters are searched."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.machine import NoController
from model import layout as at
from model.arrays import Floats
from model.discrepancy.candidates.library import TAUT_QUANTILES, TAUT_WITHIN, is_beside
from model.discrepancy.excitation import own_frequencies
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.stated_numbers import number_trials, stated_trial
from model.discrepancy.inverse_dynamics.trial import Start, Trial
from model.effects.effect import Effect
from model.effects.library import library
from model.inverse_dynamics.drive_timing import MOST
from model.inverse_dynamics.recorded_motion import RESOLVED, RecordedMotion
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES, levels_along
from model.machine_model.effect_parameters import suits_drive
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

UNSEEN = ("backlash", "damping")
"""Part of an effect that torques do not show: the damping of a contact acts in its vibration, above every cutoff."""
DAMPED = 0.1
"""Damping ratio of a rotor on its gear's spring from which damping is tried."""
SENSOR_EFFECTS = ("potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity")
BENT = "potentiometer_nonlinearity"
FREED_BENDS = ("bend_1", "bend_2", "bend_3", "bend_4")
"""Terms of a bent sensor that a trial frees; the shorter waves keep the priors of a sound one."""
UNDER_LOAD = {"load_dependent_friction": "arm", "gravity_torque_friction": "share"}
"""Effects whose friction goes with a load that the posture decides, and the parameter that multiplies it."""
EITHER_WAY = (
    "direction_dependent_friction",
    "direction_dependent_viscous_friction",
    "direction_dependent_gear_loss",
)
"""Effects that act one way by their sign: they have no slope from one sign to the other, and are begun with both."""
CONSTANT_LOAD = 0.05
"""Relative change of a load below which it counts as constant."""
SPEED_QUANTILES = (0.05, 0.2, 0.5, 0.8)
"""Quantiles of a joint's speed in magnitude: speeds at which Stribeck friction may have faded."""
DRIVE_QUANTILES = (0.2, 0.5, 0.8)
"""Quantiles of the drive in magnitude that are tried as dead zones."""
THRESHOLD_SHARES = tuple(float(share) for share in np.geomspace(0.02, 0.6, 16))
"""Thresholds of an amplifier that are tried, as shares of the largest drive, each a quarter larger than the one before:
a search goes from sample to sample, and finds a threshold only from near it."""
PASSED = 0.3
"""Least share of the record in which the drive is above a threshold that is tried."""
LIMIT_SHARES = (0.95, 0.85, 0.7, 0.5)
"""Limits of the drive that are tried, as shares of its largest value."""
UNLIMITED = 0.7
"""Least share of the record in which the drive stays below a limit that is tried."""
DELAYS = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08)
"""Delays, and time constants of windings, that are tried, s."""
WARMING_TIMES = (10.0, 40.0, 200.0)
"""Thermal time constants that are tried, s."""
LARGEST_HEATING = 0.2
"""Largest rise of a winding's resistance in a second of the record's own current: copper 50 K warmer in a second."""
RISE = 0.2
"""Rise of a winding's resistance in a record that is tried: copper 50 K warmer."""
WINDING_SHARES = (0.01, 0.1)
"""Shares of a joint's torque that the motion of the rotor relative to its link may take; they set the compliances that
are tried."""
PLAY_SHARES = (0.0005, 0.003, 0.02)
"""Free play that is tried, as a share of the joint's travel."""
FASTEST_RIPPLE = 1000.0
"""Most waves of a ripple a turn (a metre) that are tried."""
LONGEST_SCAN = 400
"""Largest number of frequencies that are tried."""


@dataclass(frozen=True)
class _Place:
    """Where starting values are looked for: a joint's column, the model with the effect, records and their residual."""

    model: Model
    column: int
    records: Sequence[RecordedMotion]
    residual: Sequence[Floats]

    @property
    def numbers(self) -> Floats:
        """The joint's columns of the model's vector."""
        return self.model.vector[at.slot(self.column + 1, 0) : at.slot(self.column + 2, 0)]

    @property
    def gain(self) -> float:
        """Torque of the drive a volt (a unit of drive), N·m/V."""
        joint = self.numbers
        return float(joint[at.GEAR] * joint[at.TORQUE_CONSTANT] / joint[at.RESISTANCE])

    @property
    def speeds(self) -> Floats:
        """Magnitudes of the joint's speed where it moves."""
        return self._magnitudes(lambda r: r.speed)

    @property
    def drives(self) -> Floats:
        """Magnitudes of the joint's drive where it moves."""
        return self._magnitudes(lambda r: r.drive)

    @property
    def positions(self) -> Floats:
        """The joint's positions in all records, rad (m)."""
        return np.concatenate([r.position[r.rows, self.column] for r in self.records])

    @property
    def slowest_ripple(self) -> float:
        """Waves a turn (rad/m) of a ripple of which one lies within the positions at which the joint moves."""
        every = np.concatenate([r.position[r.rows, self.column][r.moving[:, self.column]] for r in self.records])
        return 2 * np.pi / max(float(np.ptp(every)) if every.size else 0.0, 1e-9)

    @property
    def current(self) -> float:
        """Root mean square of the motor's settled current where the joint moves, A."""
        joint = self.numbers
        per_speed = joint[at.GEAR] * joint[at.BACK_EMF]
        currents = self._magnitudes(lambda r: (r.drive - per_speed * r.speed) / joint[at.RESISTANCE])
        return float(np.sqrt(np.mean(currents**2)))

    @property
    def duration(self) -> float:
        """Of the longest record, s."""
        return max(float(np.ptp(r.time)) for r in self.records)

    @property
    def torque(self) -> float:
        """A tenth of the drive's torque, N·m or N: a size to probe with."""
        return max(0.1 * abs(self.gain) * float(np.sqrt(np.mean(self.drives**2))), 1e-9)

    def _magnitudes(self, signal: Callable[[RecordedMotion], Floats]) -> Floats:
        pieces = [np.abs(signal(r)[r.rows, self.column])[r.moving[:, self.column]] for r in self.records]
        every = np.concatenate(pieces)
        return every if every.size else np.zeros(1)


def list_trials(model: Model, now: BalanceFit, case: TorqueCase) -> Iterator[Trial]:
    """Every effect that the model lacks, joint by joint, and those of the whole machine once; of what the file states,
    whether it is another size than stated; and numbers of the machine that the fit has moved."""
    names = case.options.effects
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
            trial = _trial(model, name, joints, now)
            if trial.starts:
                yield trial
    yield from number_trials(model, now, case)


def _trial(model: Model, name: str, joints: tuple[int, ...], now: BalanceFit) -> Trial:
    """One effect on one joint, or of the whole machine."""
    wider = model.with_effect(name, joints)
    place = _Place(wider, joints[0] - 1 if joints else 0, now.balance.records, now.residual)
    sizes = recorded_sizes(wider, now.balance.records)
    added = (
        sizes.get(p.name, p) for p in wider.parameters if p.name not in model.by_name and (p.effect, p.part) != UNSEEN
    )
    own = tuple(_narrowed(p, place) for p in added if p.effect != BENT or p.part in FREED_BENDS)
    amplitudes = tuple(p.name for p in own if p.null is not None)
    return Trial(name, joints, wider, own, amplitudes, tuple(_starts(name, own, place)))


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


def _starts(name: str, own: Sequence[Parameter], place: _Place) -> Iterator[Start]:
    """Values to probe from: finite sizes, since many effects have no useful derivative at their null value."""
    search = _SEARCHED.get(name)
    if search is None:
        yield {p.name: _typical(p) for p in own}
        if name in EITHER_WAY:
            yield {p.name: -_typical(p) for p in own}
        return
    by_part = {p.part: p for p in own}
    for start in search(place):
        yield {by_part[k].name: _inside(by_part[k], v) for k, v in start.items() if k in by_part}


def _narrowed(p: Parameter, place: _Place) -> Parameter:  # noqa: PLR0911 (one line an effect)
    """The parameter, with bounds narrowed to what the record allows.

    A limit of the drive must leave most of the record below it, and a threshold a part above it: a drive that hardly
    ever acts would explain any motion, with bodies without mass. Friction must not change within the speeds at which
    its direction is not resolved. A spring on one side must begin to pull within the recorded positions. A ripple
    repeats itself within them: less than one wave is a spring, or a shifted sensor.
    """
    if p.effect == "stribeck_friction" and p.null is None:
        slowest = RESOLVED * max(float(r.turning[place.column]) for r in place.records)
        return replace(p, low=min(p.high, max(p.low, slowest)))
    if p.effect == "one_sided_spring" and p.null is None:
        low, high = np.quantile(place.positions, TAUT_WITHIN)
        return replace(p, low=float(low), high=float(high))
    if p.effect == "resistance_drift" and p.null is not None:
        return replace(p, high=min(p.high, LARGEST_HEATING / max(place.current**2, 1e-12)))
    if p.effect == "amplifier_threshold":
        return replace(p, high=max(p.low, min(p.high, float(np.quantile(place.drives, 1 - PASSED)))))
    if p.effect == "torque_ripple" and p.null is None:
        return replace(p, low=min(p.high, max(p.low, place.slowest_ripple)))
    if p.effect != "supply_limit":
        return p
    return replace(p, low=min(p.high, max(p.low, float(np.quantile(place.drives, UNLIMITED)))))


def _typical(p: Parameter) -> float:
    size = p.deviation if p.deviation is not None else abs(p.value) or 1.0
    return _inside(p, p.value + size if p.null is not None else p.value)


def _inside(p: Parameter, value: float) -> float:
    return float(np.clip(value, p.low, p.high))


def _stribeck(place: _Place) -> Iterator[Start]:
    for speed in np.quantile(place.speeds, SPEED_QUANTILES):
        yield {"torque": place.torque, "speed": max(float(speed), 1e-3)}


def _dead_zone(place: _Place) -> Iterator[Start]:
    drive = place.drives
    for width in (0.05 * float(drive.max()), *np.quantile(drive, DRIVE_QUANTILES)):
        yield {"width": float(width)}


def _threshold(place: _Place) -> Iterator[Start]:
    largest, highest = float(place.drives.max()), float(np.quantile(place.drives, 1 - PASSED))
    for width in (share * largest for share in THRESHOLD_SHARES):
        if width <= highest:
            yield {"width": width}


def _limit(place: _Place) -> Iterator[Start]:
    largest, supply = float(place.drives.max()), float(place.numbers[at.SUPPLY])
    for share in LIMIT_SHARES:
        if share * min(largest, supply) > 0:
            yield {"voltage": share * min(largest, supply)}


def _delay(place: _Place) -> Iterator[Start]:
    controller = place.model.machine.controller
    if isinstance(controller, NoController):
        least = MOST * max(r.sampled for r in place.records)
        for time in [t for t in DELAYS if t > least] or [1.5 * least]:
            yield {"time": time}
        return
    for time in DELAYS:
        if time <= 13 * controller.period.value:
            yield {"time": time}


def _inductance(place: _Place) -> Iterator[Start]:
    for time in DELAYS:
        yield {"inductance": float(place.numbers[at.RESISTANCE]) * time}


def _warming(place: _Place) -> Iterator[Start]:
    for time in WARMING_TIMES:
        yield {"heating": RISE / max(place.current**2 * min(time, place.duration), 1e-12), "time_constant": time}


def _timed_warming(place: _Place) -> Iterator[Start]:
    for time, side in itertools.product(WARMING_TIMES, (1.0, -1.0)):
        yield {"rise": side * RISE / (1.0 - float(np.exp(-place.duration / time))), "time_constant": time}


def _ripple(place: _Place) -> Iterator[Start]:
    column, records = place.column, place.records
    if place.slowest_ripple > FASTEST_RIPPLE:
        return
    travel = 2 * np.pi / place.slowest_ripple
    slow = float(np.quantile(place.speeds, 0.25))
    highest = 2 * np.pi * records[0].cutoff / max(slow, 1e-9)
    grid = _scanned(max(place.slowest_ripple, 0.5), min(highest, FASTEST_RIPPLE), 0.7 * np.pi / travel)
    prismatic = place.model.machine.joint(column + 1).kind == "prismatic"
    if not prismatic and travel > np.pi:
        whole = np.arange(1, min(int(highest), 200) + 1, dtype=np.float64)
        grid = np.unique(np.concatenate([grid, whole]))
    for cycles in _peaks(grid, [r.position[r.rows, column] for r in records], place):
        yield {"sine": place.torque, "cosine": place.torque, "cycles": cycles}


def _disturbance(place: _Place) -> Iterator[Start]:
    longest = max(float(np.ptp(r.time)) for r in place.records)
    grid = _scanned(max(0.05, 2 / longest), 0.8 * place.records[0].cutoff, 0.4 / longest)
    grid = grid[~own_frequencies(grid, [r.speed for r in place.records], place.records[0].period)]
    for rate in _peaks(2 * np.pi * grid, [r.time[r.rows] for r in place.records], place):
        yield {"sine": place.torque, "cosine": place.torque, "frequency": rate / (2 * np.pi)}


def _spring(place: _Place) -> Iterator[Start]:
    middle, span = float(np.mean(place.positions)), float(np.ptp(place.positions))
    for rest in (middle, middle - 2 * span, middle + 2 * span):
        yield {"stiffness": place.torque / max(span, 1e-9), "rest": rest}


def _cable(place: _Place) -> Iterator[Start]:
    stiffness = place.torque / max(float(np.ptp(place.positions)), 1e-9)
    for rest, side in itertools.product(np.quantile(place.positions, TAUT_QUANTILES), (1.0, -1.0)):
        yield {"stiffness": side * stiffness, "rest": float(rest)}


def _compliance(place: _Place) -> Iterator[Start]:
    """Compliances with which the motion of the rotor relative to the link takes a share of the torque."""
    joint = place.numbers
    gain = joint[at.GEAR] * joint[at.TORQUE_CONSTANT] / joint[at.RESISTANCE]
    torques = [gain * r.drive[:, place.column] for r in place.records]
    changes = [np.gradient(np.gradient(t, r.time), r.time) for t, r in zip(torques, place.records, strict=True)]
    inertia = joint[at.ROTOR_INERTIA] * joint[at.GEAR] ** 2
    whole = float(np.std(np.concatenate(torques)) / max(inertia * np.std(np.concatenate(changes)), 1e-300))
    for share in WINDING_SHARES:
        compliance = share * whole
        yield {"compliance": compliance, "damping": 2 * DAMPED * float(np.sqrt(inertia / max(compliance, 1e-300)))}


def _play(place: _Place) -> Iterator[Start]:
    travel = max(float(np.ptp(r.position[:, place.column])) for r in place.records)
    for share in PLAY_SHARES:
        yield {"gap": share * travel}


def _tilt(_place: _Place) -> Iterator[Start]:
    yield {"about_x": 0.05, "about_y": 0.05}


def _scanned(low: float, high: float, step: float) -> Floats:
    if high <= low:
        return np.array([low])
    return np.linspace(low, high, int(np.clip((high - low) / step, 2, LONGEST_SCAN)))


def _peaks(rates: Floats, along: Sequence[Floats], place: _Place) -> list[float]:
    """The two rates (rad per unit of `along`) whose sine and cosine explain most of the residual of a joint."""
    masks = [r.moving[:, place.column] for r in place.records]
    signal = np.concatenate([x[:, place.column][m] for x, m in zip(place.residual, masks, strict=True)])
    where = np.concatenate([a[m] for a, m in zip(along, masks, strict=True)])
    if signal.size < 20:
        return []
    signal = signal - signal.mean()
    power = np.abs(np.exp(-1j * np.outer(rates, where)) @ signal)
    order = np.argsort(power)[::-1]
    found: list[float] = []
    for k in order:
        if all(abs(rates[k] - f) > 3 * (rates[1] - rates[0] if len(rates) > 1 else 0) for f in found):
            found.append(float(rates[k]))
        if len(found) == 2:
            break
    return found


_SEARCHED: dict[str, Callable[[_Place], Iterator[Start]]] = {
    "stribeck_friction": _stribeck,
    "dead_zone": _dead_zone,
    "amplifier_threshold": _threshold,
    "supply_limit": _limit,
    "input_delay": _delay,
    "motor_inductance": _inductance,
    "resistance_drift": _warming,
    "resistance_rise": _timed_warming,
    "torque_ripple": _ripple,
    "periodic_disturbance": _disturbance,
    "spring_torque": _spring,
    "one_sided_spring": _cable,
    "base_tilt": _tilt,
    "joint_compliance": _compliance,
    "backlash": _play,
}
"""Effects whose starting values depend on the record, and the functions that find them."""
