"""Which effects may explain residual torques, on which joints, and where to begin looking for their parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import BoardPid, DcMotor, NoController, SampledPid
from model import layout as at
from model.discrepancy.inverse_dynamics.balance import levels_along
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.discrepancy.inverse_dynamics.records import RESOLVED, TorqueRecord
from model.effects.effect import Effect
from model.effects.library import library
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Floats = NDArray[np.float64]
Start = dict[str, float]

NOT_IN_TORQUE_SPACE = {
    "wrong_gain": "acts before the drive that is recorded",
    "lost_set_points": "acts before the drive that is recorded",
    "stiction": "shows in the moment of breaking away, which low-passed torques do not resolve",
}
"""Effects that recorded torques cannot show, and why."""
UNSEEN = ".damping"
"""Parameters that torques do not show: a transmission's damping acts while its parts swing, above every cutoff."""
MOTOR_EFFECTS = ("back_emf_error", "resistance_drift", "motor_inductance")
SENSOR_EFFECTS = ("potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity")
ROTOR_EFFECTS = ("backlash", "joint_compliance")
CONSTANT_LOAD = 0.05
"""Relative change of a load below which it counts as constant."""
SPEED_QUANTILES = (0.05, 0.2, 0.5, 0.8)
"""Of a joint's speed in magnitude: where friction may have fallen."""
DRIVE_QUANTILES = (0.2, 0.5, 0.8)
"""Of the drive in magnitude: dead zones; and limits, as shares of the largest."""
UNLIMITED = 0.7
"""Share of the record in which a limit of the drive must not be reached."""
LIMIT_SHARES = (0.95, 0.85, 0.7, 0.5)
DELAYS = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08)
"""s: delays, and time constants of windings."""
WINDING_SHARES = (0.01, 0.1)
"""Of a joint's torque: what a rotor on a spring may take beside its link's motion."""
PLAY_SHARES = (0.0005, 0.003, 0.02)
"""Of a joint's travel: free play."""
LONGEST_SCAN = 400
"""Frequencies that are tried, at most."""


@dataclass(frozen=True)
class Trial:
    """An effect on joints, the starts to look from, and over how many places the looking went.

    amplitudes: its parameters (full names) that measure its size; the others only shape it.
    """

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    amplitudes: tuple[str, ...]
    starts: tuple[Start, ...]

    @property
    def size(self) -> int:
        """Parameters that the effect adds."""
        return len(self.parameters)


def trials(
    model: Model, records: Sequence[TorqueRecord], residual: Sequence[Floats], options: TorqueOptions
) -> Iterator[Trial]:
    """Every effect that the model lacks, joint by joint, and those of the whole machine once."""
    names = options.effects
    for name, effect in library().items():
        if name in NOT_IN_TORQUE_SPACE or (names is not None and name not in names):
            continue
        places: list[tuple[int, ...]] = (
            [()] if effect.whole_machine else [(j,) for j in options.joints or model.machine.modelled_joints]
        )
        for joints in places:
            if _present(model, name, joints) or not _possible(model, effect, joints):
                continue
            if name == "load_dependent_friction" and _constant_load(model, joints[0] - 1, records):
                continue  # the same torque as Coulomb friction, by a longer name
            trial = trial_of(model, name, joints, records, residual)
            if trial.starts:
                yield trial


def trial_of(
    model: Model, name: str, joints: tuple[int, ...], records: Sequence[TorqueRecord], residual: Sequence[Floats]
) -> Trial:
    """One effect on one joint, or of the whole machine."""
    wider = model.with_effect(name, joints)
    column = joints[0] - 1 if joints else 0
    added = (p for p in wider.parameters if p.name not in model.by_name and not p.name.endswith(UNSEEN))
    own = tuple(_narrowed(p, column, records) for p in added)
    starts = tuple(_starts(name, wider, own, column, records, residual))
    return Trial(name, joints, wider, own, tuple(p.name for p in own if p.null is not None), starts)


def _constant_load(model: Model, column: int, records: Sequence[TorqueRecord]) -> bool:
    """Whether the load that presses on a joint is the same wherever it went."""
    arm = model.with_effect("load_dependent_friction", (column + 1,), {"arm": 1.0})
    levels = np.concatenate([levels_along(arm, r)[r.rows, column] for r in records])
    return bool(np.ptp(levels) < CONSTANT_LOAD * np.abs(levels).max() + 1e-12)


def _present(model: Model, name: str, joints: tuple[int, ...]) -> bool:
    return any(u.name == name and (not joints or set(u.joints) & set(joints)) for u in model.effects)


def _possible(model: Model, effect: Effect, joints: tuple[int, ...]) -> bool:
    """Whether the effect can do anything on this machine."""
    falls = any(model.machine.gravity)
    if not joints:
        return effect.name != "base_tilt" or falls
    joint, row = model.machine.joint(joints[0]), at.slot(joints[0], 0)
    needs = {
        "centre_of_mass": model.vector[row + at.A] != 0.0,
        "load_dependent_friction": falls,
        **dict.fromkeys(MOTOR_EFFECTS, isinstance(joint.drive, DcMotor)),
        **dict.fromkeys(ROTOR_EFFECTS, model.vector[row + at.ROTOR_INERTIA] > 0),
        **dict.fromkeys(
            SENSOR_EFFECTS,
            joint.sensor is not None and joint.sensor.measures == "position" and joint.sensor.linearity is not None,
        ),
    }
    return bool(needs.get(effect.name, True)) and (not effect.joints or set(joints) <= set(effect.joints))


def _starts(
    name: str, model: Model, own: Sequence[Parameter], column: int, records: Sequence[TorqueRecord],
    residual: Sequence[Floats],
) -> Iterator[Start]:  # fmt: skip
    """Values to probe from: finite sizes, since many effects have no useful derivative where they begin."""
    by_last = {p.name.rpartition(".")[2]: p for p in own}
    special = _SPECIAL.get(name)
    if special is not None:
        for start in special(model, column, records, residual):
            yield {by_last[k].name: _inside(by_last[k], v) for k, v in start.items()}
        return
    grids = [[_typical(p)] for p in own]
    for values in product(*grids):
        yield {p.name: v for p, v in zip(own, values, strict=True)}


def _narrowed(p: Parameter, column: int, records: Sequence[TorqueRecord]) -> Parameter:
    """A limit of the drive must leave most of the record below it: a drive that never acts explains any motion, by
    bodies without mass. And friction must not change within the speeds in which its direction is not resolved."""
    if p.effect == "stribeck_friction" and p.null is None:
        slowest = RESOLVED * max(float(r.turning[column]) for r in records)
        return replace(p, low=min(p.high, max(p.low, slowest)))
    if p.effect != "supply_limit":
        return p
    drive = _magnitudes(lambda r: r.drive, records, column)
    return replace(p, low=min(p.high, max(p.low, float(np.quantile(drive, UNLIMITED)))))


def _typical(p: Parameter) -> float:
    size = p.deviation if p.deviation is not None else abs(p.value) or 1.0
    return _inside(p, p.value + size if p.null is not None else p.value)


def _inside(p: Parameter, value: float) -> float:
    return float(np.clip(value, p.low, p.high))


def _magnitudes(signal: Callable[[TorqueRecord], Floats], records: Sequence[TorqueRecord], column: int) -> Floats:
    every = np.concatenate([np.abs(signal(r)[r.rows, column])[r.moving[:, column]] for r in records])
    return every if every.size else np.zeros(1)


def _stribeck(model: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    speeds = _magnitudes(lambda r: r.speed, records, column)
    for speed in np.quantile(speeds, SPEED_QUANTILES):
        yield {"torque": _torque(model, column, records), "speed": max(float(speed), 1e-3)}


def _dead_zone(_m: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    drive = _magnitudes(lambda r: r.drive, records, column)
    for width in (0.05 * float(drive.max()), *np.quantile(drive, DRIVE_QUANTILES)):
        yield {"width": float(width)}


def _limit(model: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    largest = float(_magnitudes(lambda r: r.drive, records, column).max())
    supply = float(model.vector[at.slot(column + 1, at.SUPPLY)])
    for share in LIMIT_SHARES:
        if share * min(largest, supply) > 0:
            yield {"voltage": share * min(largest, supply)}


def _delay(model: Model, _c: int, _records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    controller = model.machine.controller
    longest = np.inf if isinstance(controller, NoController) else 13 * _period(controller)
    for time in DELAYS:
        if time <= longest:
            yield {"time": time}


def _period(controller: BoardPid | SampledPid) -> float:
    return controller.period.value


def _inductance(model: Model, column: int, _r: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    resistance = float(model.vector[at.slot(column + 1, at.RESISTANCE)])
    for time in DELAYS:
        yield {"inductance": resistance * time}


def _warming(model: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    resistance = float(model.vector[at.slot(column + 1, at.RESISTANCE)])
    current = float(np.sqrt(np.mean(_magnitudes(lambda r: r.drive, records, column) ** 2))) / resistance
    for time in (10.0, 40.0, 200.0):
        yield {"heating": 0.2 / max(current**2 * time, 1e-12), "time_constant": time}


def _ripple(model: Model, column: int, records: Sequence[TorqueRecord], left: Sequence[Floats]) -> Iterator[Start]:
    every = np.concatenate([r.position[r.rows, column][r.moving[:, column]] for r in records])
    if np.ptp(every) <= 0:
        return
    slow = float(np.quantile(_magnitudes(lambda r: r.speed, records, column), 0.25))
    highest = 2 * np.pi * records[0].cutoff / max(slow, 1e-9)
    lowest = 2 * np.pi / float(np.ptp(every))
    prismatic = model.machine.joint(column + 1).kind == "prismatic"
    grid = _scanned(max(lowest, 0.5), min(highest, 1000.0), 0.7 * np.pi / float(np.ptp(every)))
    if not prismatic and float(np.ptp(every)) > np.pi:
        whole = np.arange(1, min(int(highest), 200) + 1, dtype=np.float64)
        grid = np.unique(np.concatenate([grid, whole]))
    torque = _torque(model, column, records)
    for cycles in _peaks(grid, [r.position[r.rows, column] for r in records], records, left, column):
        yield {"sine": torque, "cosine": torque, "cycles": cycles}


def _disturbance(model: Model, column: int, records: Sequence[TorqueRecord], left: Sequence[Floats]) -> Iterator[Start]:
    longest = max(float(np.ptp(r.time)) for r in records)
    grid = _scanned(max(0.05, 2 / longest), 0.8 * records[0].cutoff, 0.4 / longest)
    torque = _torque(model, column, records)
    angular = 2 * np.pi * grid
    for rate in _peaks(angular, [r.time[r.rows] for r in records], records, left, column):
        yield {"sine": torque, "cosine": torque, "frequency": rate / (2 * np.pi)}


def _spring(model: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    position = np.concatenate([r.position[r.rows, column] for r in records])
    stiffness = _torque(model, column, records) / max(float(np.ptp(position)), 1e-9)
    middle, span = float(np.mean(position)), float(np.ptp(position))
    for rest in (middle, middle - 2 * span, middle + 2 * span):
        yield {"stiffness": stiffness, "rest": rest}


def _winding(model: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    """Compliances with which turning the rotor apart from the link takes a share of the torque."""
    joint = model.vector[at.slot(column + 1, 0) : at.slot(column + 2, 0)]
    gain = joint[at.GEAR] * joint[at.TORQUE_CONSTANT] / joint[at.RESISTANCE]
    torque = np.concatenate([gain * r.drive[:, column] for r in records])
    change = np.concatenate([np.gradient(np.gradient(gain * r.drive[:, column], r.time), r.time) for r in records])
    inertia = joint[at.ROTOR_INERTIA] * joint[at.GEAR] ** 2
    whole = float(np.std(torque) / max(inertia * np.std(change), 1e-300))
    for share in WINDING_SHARES:
        yield {"compliance": share * whole}


def _play(_m: Model, column: int, records: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    travel = max(float(np.ptp(r.position[:, column])) for r in records)
    for share in PLAY_SHARES:
        yield {"gap": share * travel}


def _tilt(_m: Model, _c: int, _r: Sequence[TorqueRecord], _left: Sequence[Floats]) -> Iterator[Start]:
    yield {"about_x": 0.05, "about_y": 0.05}


def _torque(model: Model, column: int, records: Sequence[TorqueRecord]) -> float:
    """A tenth of the drive's torque, N·m or N: a size to probe with."""
    joint = model.vector[at.slot(column + 1, 0) : at.slot(column + 2, 0)]
    gain = joint[at.GEAR] * joint[at.TORQUE_CONSTANT] / joint[at.RESISTANCE]
    drive = _magnitudes(lambda r: r.drive, records, column)
    return max(0.1 * abs(float(gain)) * float(np.sqrt(np.mean(drive**2))), 1e-9)


def _scanned(low: float, high: float, step: float) -> Floats:
    if high <= low:
        return np.array([low])
    return np.linspace(low, high, int(np.clip((high - low) / step, 2, LONGEST_SCAN)))


def _peaks(
    rates: Floats, along: Sequence[Floats], records: Sequence[TorqueRecord], left: Sequence[Floats], column: int
) -> list[float]:
    """The two rates (rad per unit of `along`) whose sine and cosine explain most of what is left of a joint."""
    masks = [r.moving[:, column] for r in records]
    signal = np.concatenate([x[:, column][m] for x, m in zip(left, masks, strict=True)])
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


_SPECIAL: dict[str, Callable[[Model, int, Sequence[TorqueRecord], Sequence[Floats]], Iterator[Start]]] = {
    "stribeck_friction": _stribeck,
    "dead_zone": _dead_zone,
    "supply_limit": _limit,
    "input_delay": _delay,
    "motor_inductance": _inductance,
    "resistance_drift": _warming,
    "torque_ripple": _ripple,
    "periodic_disturbance": _disturbance,
    "spring_torque": _spring,
    "base_tilt": _tilt,
    "joint_compliance": _winding,
    "backlash": _play,
}
"""Effects whose place has to be looked for in the record."""
