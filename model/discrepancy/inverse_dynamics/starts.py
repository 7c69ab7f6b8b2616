"""From which values an effect's parameters are searched, and within which bounds, by what the records hold."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.machine import NoController
from model import layout as at
from model.arrays import Floats
from model.discrepancy.engine.lifted import MOST_OF_A_RECORD, TRIED_QUANTILES
from model.discrepancy.engine.probing import Start
from model.discrepancy.excitation import PERIODS, own_frequencies
from model.fitting.phases import phase_part, phases_of
from model.inverse_dynamics.drive_timing import MOST
from model.inverse_dynamics.recorded_motion import RESOLVED, RecordedMotion
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

NONLINEAR = frozenset(
    {
        "dead_zone",
        "amplifier_threshold",
        "supply_limit",
        "input_delay",
        "motor_inductance",
        "resistance_drift",
        "resistance_rise",
        "backlash",
        "joint_compliance",
    }
)
"""Effects whose torque is far from linear in their size."""
LEAST_OF_WAVE = 0.8
"""Least share of a ripple's wave within the travel of a joint: a slower one is a spring."""


@dataclass(frozen=True)
class Place:
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
    def middle(self) -> float:
        """The mean of these positions, rad (m)."""
        return float(np.mean(self.positions))

    @property
    def travel(self) -> float:
        """How far these positions reach, rad (m)."""
        return float(np.ptp(self.positions))

    @property
    def longest_travel(self) -> float:
        """How far the joint moves in one record, rad (m)."""
        return max(float(np.ptp(r.position[:, self.column])) for r in self.records)

    @property
    def largest_drive(self) -> float:
        """The largest magnitude of the drive where the joint moves."""
        return float(self.drives.max())

    @property
    def largest_supplied(self) -> float:
        """The same, or the supply where that is less."""
        return min(self.largest_drive, float(self.numbers[at.SUPPLY]))

    @property
    def passed_drive(self) -> float:
        """The magnitude above which the drive is in a share `PASSED` of the record."""
        return float(np.quantile(self.drives, 1 - PASSED))

    @property
    def slowest_ripple(self) -> float:
        """Slowest rate, in rad of phase per rad (m), of a ripple: most of a wave (`LEAST_OF_WAVE`) lies within the
        positions at which the joint moves."""
        every = np.concatenate([r.position[r.rows, self.column][r.moving[:, self.column]] for r in self.records])
        return LEAST_OF_WAVE * 2 * np.pi / max(float(np.ptp(every)) if every.size else 0.0, 1e-9)

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
    def slowest_disturbance(self) -> float:
        """Hz, of one that repeats itself in a record."""
        return PERIODS / self.duration

    @property
    def torque(self) -> float:
        """A tenth of the drive's torque, N·m or N: a size to probe with."""
        return max(0.1 * abs(self.gain) * float(np.sqrt(np.mean(self.drives**2))), 1e-9)

    def _magnitudes(self, signal: Callable[[RecordedMotion], Floats]) -> Floats:
        pieces = [np.abs(signal(r)[r.rows, self.column])[r.moving[:, self.column]] for r in self.records]
        every = np.concatenate(pieces)
        return every if every.size else np.zeros(1)


DAMPED = 0.1
"""Damping ratio of a rotor on its gear's spring from which damping is tried."""
EITHER_WAY = (
    "direction_dependent_friction",
    "direction_dependent_viscous_friction",
    "direction_dependent_gear_loss",
)
"""Effects that act one way by their sign: they have no slope from one sign to the other, and are begun with both."""
SPEED_QUANTILES = (0.05, 0.2, 0.5, 0.8)
"""Quantiles of a joint's speed in magnitude: speeds at which Stribeck friction may have faded."""
THRESHOLD_SHARES = tuple(float(share) for share in np.geomspace(0.02, 0.6, 16))
"""Thresholds of an amplifier that are tried, as shares of the largest drive, each a quarter larger than the one before:
a search goes from sample to sample, and finds a threshold only from near it."""
PASSED = 0.3
"""Least share of the record in which the drive is above a threshold that is tried."""
LEAST_STRETCH = 0.01
"""Least share of a joint's travel within which a spring on one side is taut. Where a joint dwells at the end of its
motion, a stiff one that is taut for a thousandth of the travel was found on a sound arm; friction holds it there."""
LIMIT_SHARES = (0.95, 0.85, 0.7, 0.5)
"""Limits of the drive that are tried, as shares of its largest value."""
UNLIMITED = 0.7
"""Least share of the record in which the drive stays below a limit that is tried."""
DELAYS = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08)
"""Delays, and time constants of windings, that are tried, s."""
WARMING_TIMES = (10.0, 40.0, 200.0)
"""Thermal time constants that are tried, s."""
RISE = 0.2
"""Rise of a winding's resistance in a record that is tried, and the largest in a second of the record's own current:
copper 50 K warmer."""
WINDING_SHARES = (0.01, 0.1)
"""Shares of a joint's torque that the motion of the rotor relative to its link may take; they set the compliances that
are tried."""
PLAY_SHARES = (0.0005, 0.003, 0.02)
"""Free play that is tried, as a share of the joint's travel."""
USUAL_TONES = 500
"""Rates at which a tone is looked for."""
FEWEST_OF_TONE = 20
"""Samples of a record from which a tone is looked for in it."""
FASTEST_RIPPLE = 1000.0
"""Fastest ripple that is tried, in rad of phase per rad (m)."""


def starts_of(name: str, own: Sequence[Parameter], place: Place) -> Iterator[Start]:
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


def narrowed(p: Parameter, place: Place) -> Parameter:  # noqa: PLR0911 (one line an effect)
    """The parameter, with bounds narrowed to what the record allows.

    A limit of the drive must leave most of the record below it, and a threshold a part above it: a drive that hardly
    ever acts would explain any motion, with bodies without mass. Friction must not fade within the speeds at which its
    direction is not resolved, nor beyond those that were recorded. A spring on one side must begin to pull within the
    recorded positions, and before the last hundredth of the travel. A ripple repeats itself within them: less than most
    of a wave is a spring, or a shifted sensor. A disturbance repeats itself in time.
    """
    if p.effect == "stribeck_friction" and p.null is None:
        slowest = RESOLVED * max(float(r.turning[place.column]) for r in place.records)
        fastest = max(slowest, float(np.quantile(place.speeds, MOST_OF_A_RECORD[1])))
        return replace(p, low=min(p.high, max(p.low, slowest)), high=min(p.high, fastest))
    if p.effect == "one_sided_spring" and p.null is None:
        stretch = LEAST_STRETCH * place.travel
        within = (place.positions.min() + stretch, place.positions.max() - stretch)
        low, high = np.clip(np.quantile(place.positions, MOST_OF_A_RECORD), *within)
        return replace(p, low=float(low), high=float(high))
    if p.effect == "resistance_drift" and p.null is not None:
        return replace(p, high=min(p.high, RISE / max(place.current**2, 1e-12)))
    if p.effect == "amplifier_threshold":
        return replace(p, high=max(p.low, min(p.high, place.passed_drive)))
    if p.effect == "torque_ripple" and p.null is None:
        return replace(p, low=min(p.high, max(p.low, place.slowest_ripple)))
    if p.effect == "periodic_disturbance" and p.null is None:
        return replace(p, low=min(p.high, max(p.low, place.slowest_disturbance)))
    if p.effect != "supply_limit":
        return p
    return replace(p, low=min(p.high, max(p.low, float(np.quantile(place.drives, UNLIMITED)))))


def _typical(p: Parameter) -> float:
    size = p.deviation if p.deviation is not None else abs(p.value) or 1.0
    return _inside(p, p.value + size if p.null is not None else p.value)


def _inside(p: Parameter, value: float) -> float:
    return float(np.clip(value, p.low, p.high))


def _delay(place: Place) -> Iterator[Start]:
    controller = place.model.machine.controller
    if isinstance(controller, NoController):
        least = MOST * max(r.sampled for r in place.records)
        for time in [t for t in DELAYS if t > least] or [1.5 * least]:
            yield {"time": time}
        return
    for time in DELAYS:
        if time <= 13 * controller.period.value:
            yield {"time": time}


def _ripple(place: Place) -> Iterator[Start]:
    column, records = place.column, place.records
    if place.slowest_ripple > FASTEST_RIPPLE:
        return
    travel = LEAST_OF_WAVE * 2 * np.pi / place.slowest_ripple
    slow = float(np.quantile(place.speeds, 0.25))
    highest = 2 * np.pi * records[0].cutoff / max(slow, 1e-9)
    grid = _scanned(max(place.slowest_ripple, 0.5), min(highest, FASTEST_RIPPLE), 0.7 * np.pi / travel)
    prismatic = place.model.machine.joint(column + 1).kind == "prismatic"
    if not prismatic and travel > np.pi:
        whole = np.arange(1, min(int(highest), 200) + 1, dtype=np.float64)
        grid = np.unique(np.concatenate([grid, whole]))
    moving = [r.moving[:, column] for r in records]
    along = np.concatenate([r.position[r.rows, column][m] for r, m in zip(records, moving, strict=True)])
    signal = np.concatenate([x[:, column][m] for x, m in zip(place.residual, moving, strict=True)])
    for cycles in _peaks(grid, [along], [signal]):
        yield {"sine": place.torque, "cosine": place.torque, "cycles": cycles}


def _disturbance(place: Place) -> Iterator[Start]:
    grid = _scanned(place.slowest_disturbance, 0.8 * place.records[0].cutoff, 0.4 / place.duration)
    grid = grid[~own_frequencies(grid, [r.speed for r in place.records], place.records[0].period)]
    masks = [r.moving[:, place.column] for r in place.records]
    times = [r.time[r.rows][m] for r, m in zip(place.records, masks, strict=True)]
    signals = [x[:, place.column][m] for x, m in zip(place.residual, masks, strict=True)]
    for rate in _peaks(2 * np.pi * grid, times, signals):
        phases = {phase_part(k): phase for k, phase in enumerate(phases_of(signals, times, rate)) if k > 0}
        yield {"sine": place.torque, "cosine": place.torque, "frequency": rate / (2 * np.pi), **phases}


def _compliance(place: Place) -> Iterator[Start]:
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


def _scanned(low: float, high: float, step: float) -> Floats:
    if high <= low:
        return np.array([low])
    return np.linspace(low, high, int(np.clip((high - low) / step, 2, USUAL_TONES)))


def _peaks(rates: Floats, along: Sequence[Floats], signals: Sequence[Floats]) -> list[float]:
    """The two rates (rad per unit of `along`) whose sine and cosine, of a phase of its own in each signal (m,), explain
    most."""
    power = np.zeros(len(rates))
    for where, signal in zip(along, signals, strict=True):
        if signal.size >= FEWEST_OF_TONE:
            tone = np.exp(-1j * np.outer(rates, where)) @ (signal - signal.mean())
            power += np.abs(tone) ** 2 / signal.size
    found: list[float] = []
    for k in np.argsort(power)[::-1] if power.any() else ():
        if all(abs(rates[k] - f) > 3 * (rates[1] - rates[0] if len(rates) > 1 else 0) for f in found):
            found.append(float(rates[k]))
        if len(found) == 2:
            break
    return found


_SEARCHED: dict[str, Callable[[Place], Iterable[Start]]] = {
    "stribeck_friction": lambda place: [
        {"torque": place.torque, "speed": max(float(speed), 1e-3)}
        for speed in np.quantile(place.speeds, SPEED_QUANTILES)
    ],
    "dead_zone": lambda place: [
        {"width": float(width)}
        for width in (0.05 * float(place.drives.max()), *np.quantile(place.drives, TRIED_QUANTILES))
    ],
    "amplifier_threshold": lambda place: [
        {"width": share * place.largest_drive}
        for share in THRESHOLD_SHARES
        if share * place.largest_drive <= place.passed_drive
    ],
    "supply_limit": lambda place: [
        {"voltage": share * place.largest_supplied} for share in LIMIT_SHARES if share * place.largest_supplied > 0
    ],
    "input_delay": _delay,
    "motor_inductance": lambda place: [{"inductance": float(place.numbers[at.RESISTANCE]) * t} for t in DELAYS],
    "resistance_drift": lambda place: [
        {"heating": RISE / max(place.current**2 * min(time, place.duration), 1e-12), "time_constant": time}
        for time in WARMING_TIMES
    ],
    "resistance_rise": lambda place: [
        {"rise": side * RISE / (1.0 - float(np.exp(-place.duration / time))), "time_constant": time}
        for time, side in itertools.product(WARMING_TIMES, (1.0, -1.0))
    ],
    "torque_ripple": _ripple,
    "periodic_disturbance": _disturbance,
    "spring_torque": lambda place: [
        {"stiffness": place.torque / max(place.travel, 1e-9), "rest": place.middle + k * place.travel}
        for k in (0, -2, 2)
    ],
    "one_sided_spring": lambda place: [
        {"stiffness": side * (place.torque / max(place.travel, 1e-9)), "rest": float(rest)}
        for rest, side in itertools.product(np.quantile(place.positions, TRIED_QUANTILES), (1.0, -1.0))
    ],
    "base_tilt": lambda _: [{"about_x": 0.05, "about_y": 0.05}],
    "joint_compliance": _compliance,
    "backlash": lambda place: [{"gap": share * place.longest_travel} for share in PLAY_SHARES],
}
"""Effects whose starting values depend on the record, and how they are found."""
