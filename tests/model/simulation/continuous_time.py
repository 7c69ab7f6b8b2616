"""The arm of joints 1-3 in continuous time, written a second time: every effect by the line of physics that documents
it, the rods by their kinetic and potential energy, and Runge and Kutta's fourth-order steps of 10 µs.

Nothing of the product takes part but the model's numbers, by their names. Within a period of control the motor's volts
change at once where each joint's delay has passed, and steps end there.
"""

from dataclasses import dataclass
from math import cos, exp, sin

import numba
import numpy as np

from daq.contracts.machine import Cylinder, Sensor
from model.arrays import Floats
from model.machine_model.model import Model, base_model

STEP = 1e-5
"""s."""
GRAVITY = 9.81
PRESLIDING_COUNTS = 0.5
"""Of the sensor: how far a joint moves until friction has built up."""
RESTICK_SPEED = 1e-3
"""rad/s: a sliding joint slower than this sticks again, as one does whose motion turns."""
PERIOD, COUNTS, GAIN = 0.02, 4096, 2.0
"""s of control, counts of the converter, P."""

# Columns of a joint's numbers.
(
    R,
    L,
    KT,
    KB,
    J,
    GEAR,
    HEATING,
    COOLING,
    TIMED_RISE,
    RISING,
    VISCOUS,
    COULOMB,
    ARM,
    GRAVITY_SHARE,
    PRESLIDING,
    STRIBECK,
    STRIBECK_SPEED,
    BREAKAWAY,
    DIRECTION,
    VISCOUS_DIRECTION,
    DRAG,
    LOSS,
    LOSS_DIRECTION,
    GIVE,
    DAMPING,
    GAP,
    RIPPLE_S,
    RIPPLE_C,
    RIPPLE_N,
    SPRING,
    REST,
    CABLE,
    SLACK,
    CONSTANT,
    SHAKE_S,
    SHAKE_C,
    SHAKE_F,
    LAGS,
    GIVES,
    STICKS,
) = range(40)
# Columns of the state. X is the relative rise of the resistance.
Q, V, Z, I, M, W, X, STUCK = range(8)  # noqa: E741 (a current)


@numba.njit(cache=True)
def _weights(s: Floats, body: Floats, weight: Floats) -> None:
    """Torques that hold the arm against gravity, N·m: the slope of its potential energy."""
    p2, p3, x, y, z = body[6], body[7], body[8], body[9], body[10]
    t2, t3 = s[1, Q], s[1, Q] + s[2, Q]
    s1, c1 = sin(s[0, Q]), cos(s[0, Q])
    along = x * c1 + y * s1
    weight[0] = -(p2 * cos(t2) + p3 * cos(t3)) * (y * c1 - x * s1)
    weight[2] = -p3 * (-sin(t3) * along + cos(t3) * z)
    weight[1] = -p2 * (-sin(t2) * along + cos(t2) * z) + weight[2]


@numba.njit(cache=True)
def _levels(s: Floats, p: Floats, body: Floats, weight: Floats, level: Floats) -> None:
    """(7.32) to (7.34) in magnitude, a constant each, and a share of the gravity torques, N·m. `body`: see `_body`."""
    weight_2, weight_3 = body[4], body[5]
    t2, t3 = s[1, Q], s[1, Q] + s[2, Q]
    level[0] = p[0, COULOMB] + p[0, ARM] * abs(weight_2 * sin(t2) * cos(t2) + weight_3 * sin(t3) * cos(t3))
    level[1] = p[1, COULOMB] + p[1, ARM] * abs(weight_2 * sin(t2) + weight_3 * sin(t3) * cos(s[2, Q]))
    level[2] = p[2, COULOMB] + p[2, ARM] * abs(weight_3 * sin(t3))
    _weights(s, body, weight)
    for j in range(3):
        level[j] += p[j, GRAVITY_SHARE] * abs(weight[j])


@numba.njit(cache=True)
def _accelerate(s: Floats, torque: Floats, rotor: Floats, body: Floats, rate: Floats) -> None:
    """Lagrange's equations of two rods on a waist: inertia across the axes a2, a3, and b that couples them."""
    i1, a2, a3, b = body[0], body[1], body[2], body[3]
    v1, v2, v3 = s[0, V], s[1, V], s[2, V]
    s2, c2, s23, c23 = sin(s[1, Q]), cos(s[1, Q]), sin(s[1, Q] + s[2, Q]), cos(s[1, Q] + s[2, Q])
    s3, c3 = sin(s[2, Q]), cos(s[2, Q])
    waist = i1 + a2 * c2 * c2 + 2 * b * c2 * c23 + a3 * c23 * c23 + rotor[0]
    by_3 = -2 * b * c2 * s23 - 2 * a3 * c23 * s23
    by_2 = -2 * a2 * c2 * s2 - 2 * b * s2 * c23 + by_3
    rate[0, V] = (torque[0] - v1 * (by_2 * v2 + by_3 * v3)) / waist
    m22, m23, m33 = a2 + a3 + 2 * b * c3 + rotor[1], a3 + b * c3, a3 + rotor[2]
    t2 = torque[1] + b * s3 * (2 * v2 * v3 + v3 * v3) + 0.5 * by_2 * v1 * v1
    t3 = torque[2] - b * s3 * v2 * v2 + 0.5 * by_3 * v1 * v1
    d = m22 * m33 - m23 * m23
    rate[1, V], rate[2, V] = (m33 * t2 - m23 * t3) / d, (m22 * t3 - m23 * t2) / d


@numba.njit(cache=True)
def _transmitted(a: Floats, twist: float, twisting: float) -> float:
    """Torque through a transmission with play and give, N·m; damping pulls nothing together."""
    stretched = max(twist - a[GAP] / 2, 0.0) + min(twist + a[GAP] / 2, 0.0)
    carried = stretched / a[GIVE] + a[DAMPING] * twisting
    return carried if carried * stretched > 0.0 else 0.0


@numba.njit(cache=True)
def _rates(t: float, s: Floats, volts: Floats, p: Floats, body: Floats, rate: Floats, work: Floats) -> None:
    """Derivative of the state (3, 8)."""
    level, torque, rotor, weight = work[0], work[1], work[2], work[3]
    _levels(s, p, body, weight, level)
    for j in range(3):
        a, q, v = p[j], s[j, Q], s[j, V]
        z = min(max(s[j, Z], -1.0), 1.0)
        turning = s[j, W] if a[GIVES] else v
        resistance = a[R] * (1 + s[j, X] + a[TIMED_RISE] * (1 - exp(-t / a[RISING])))
        settled = (volts[j] - a[KB] * a[GEAR] * turning) / resistance
        current = s[j, I] if a[LAGS] else settled
        motor = a[GEAR] * a[KT] * current - a[GEAR] ** 2 * a[VISCOUS] * turning
        link = -z * (level[j] + a[STICKS] * s[j, STUCK] * a[BREAKAWAY] + a[LOSS] * abs(motor))
        link -= z * a[STRIBECK] * exp(-abs(v) / a[STRIBECK_SPEED])
        if a[DIRECTION] * z > 0:
            link -= abs(a[DIRECTION]) * z
        link -= a[GEAR] ** 2 * max(a[VISCOUS_DIRECTION] * v, 0.0) * (1.0 if v > 0 else -1.0)
        link -= a[DRAG] * abs(v) * v
        if a[LOSS_DIRECTION] * motor * z > 0:
            link -= abs(a[LOSS_DIRECTION] * motor) * z
        link += a[RIPPLE_S] * sin(a[RIPPLE_N] * q) + a[RIPPLE_C] * cos(a[RIPPLE_N] * q) - a[SPRING] * (q - a[REST])
        link += a[CONSTANT]
        link -= max(a[CABLE], 0.0) * max(q - a[SLACK], 0.0) - min(a[CABLE], 0.0) * min(q - a[SLACK], 0.0)
        turn = 2 * np.pi * a[SHAKE_F] * t
        link += a[SHAKE_S] * sin(turn) + a[SHAKE_C] * cos(turn)
        rate[j, W], rotor[j] = 0.0, a[J] * a[GEAR] ** 2
        if a[GIVES]:
            carried = _transmitted(a, s[j, M] - q, s[j, W] - v)
            rate[j, W] = (motor - carried) / rotor[j]
            motor, rotor[j] = carried, 0.0
        torque[j] = link + motor - weight[j]
        rate[j, Q], rate[j, M] = v, s[j, W]
        rate[j, Z] = 0.0 if (s[j, Z] >= 1 and v > 0) or (s[j, Z] <= -1 and v < 0) else v / a[PRESLIDING]
        rate[j, I] = a[LAGS] * (volts[j] - resistance * s[j, I] - a[KB] * a[GEAR] * turning) / a[L]
        rate[j, X] = a[HEATING] * current**2 - s[j, X] / a[COOLING]
    _accelerate(s, torque, rotor, body, rate)


@numba.njit(cache=True)
def _moved(s: Floats, h: float, rate: Floats, out: Floats) -> None:
    for j in range(3):
        for i in range(8):
            out[j, i] = s[j, i] + h * rate[j, i]


@numba.njit(cache=True)
def _advance(t: float, duration: float, step: float, s: Floats, volts: Floats, p: Floats, body: Floats) -> None:
    """Moves the state on by `duration` s at constant volts."""
    if duration <= 0.0:
        return
    steps = int(np.ceil(duration / step - 1e-9))
    h = duration / steps
    k, there, work = np.zeros((4, 3, 8)), np.zeros((3, 8)), np.zeros((4, 3))
    for n in range(steps):
        now = t + n * h
        _rates(now, s, volts, p, body, k[0], work)
        for stage in range(1, 4):
            reach = h if stage == 3 else h / 2
            _moved(s, reach, k[stage - 1], there)
            _rates(now + reach, there, volts, p, body, k[stage], work)
        for stage, weight in ((0, 1.0), (1, 2.0), (2, 2.0), (3, 1.0)):
            _moved(s, weight * h / 6, k[stage], s)
        _levels(s, p, body, work[3], work[0])
        for j in range(3):
            _settle(s[j], p[j], work[0, j])


@numba.njit(cache=True)
def _settle(s: Floats, a: Floats, level: float) -> None:
    """What contacts do between steps: z has an end, a joint breaks away there, and sticks again when it stops."""
    s[Z] = min(max(s[Z], -1.0), 1.0)
    if not a[STICKS]:
        return
    if s[STUCK] > 0.5:
        if abs(s[Z]) >= 1.0:
            s[STUCK] = 0.0
    elif abs(s[V]) < RESTICK_SPEED or s[V] * s[Z] < 0:
        if level + a[BREAKAWAY] > 0:
            s[Z] *= level / (level + a[BREAKAWAY])
        s[STUCK] = 1.0


def readings(model: Model, set_points: Floats, start: Floats, step: float = STEP) -> Floats:
    """Readings (k, 3), rad, at every period of the board's control without rounding, from rest and zero drive.

    Args:
        set_points: (k, 3) ADC counts as the board takes them. start: (3,) rad. step: longest step, s.
    """
    value = {p.name: p.value for p in model.parameters}
    p, body = _joint_numbers(model, value), _body(model, value)
    state = np.zeros((3, 8))
    state[:, Q] = state[:, M] = start
    state[:, STUCK] = 1.0
    level, weight = np.zeros(3), np.zeros(3)
    _levels(state, p, body, weight, level)
    state[:, Z] = np.clip(-weight / (level + p[:, STICKS] * p[:, BREAKAWAY]), -1.0, 1.0)  # what it holds at rest
    state[:, M] += p[:, GIVES] * p[:, GAP] / 2
    sides = [_Joint(model, j, value) for j in (1, 2, 3)]
    delay = [value["controller.delay"] + side.of("input_delay.time") for side in sides]
    changes = sorted((k * PERIOD + delay[j], j, k) for k in range(len(set_points)) for j in range(3))
    shown, commands = np.zeros((len(set_points), 3)), np.zeros((len(set_points), 3))
    volts, now = np.zeros(3), 0.0
    for k in range(len(set_points)):
        while changes[0][0] < k * PERIOD - 1e-12:  # the drive of an earlier period reaches its joint
            then, j, which = changes.pop(0)
            _advance(now, then - now, step, state, volts, p, body)
            volts[j], now = sides[j].volts(commands[which, j]), then
        _advance(now, k * PERIOD - now, step, state, volts, p, body)
        now = k * PERIOD
        for j, side in enumerate(sides):
            shown[k, j] = side.reading(state[j, Q])
            commands[k, j] = side.command(set_points[k, j], set_points[max(k - 1, 0), j], shown[k, j])
    return shown


@dataclass
class _Joint:
    """Sensor, board and amplifier of one joint."""

    model: Model
    number: int
    value: dict[str, float]

    def of(self, name: str, null: float = 0.0) -> float:
        return self.value.get(f"joint{self.number}.{name}", null)

    @property
    def sensor(self) -> Sensor:
        found = self.model.machine.joint(self.number).sensor
        assert found is not None
        return found

    def reading(self, angle: float) -> float:
        """Scale about the middle of the range, shift, and a sine series over the range."""
        x = (angle - self.sensor.at_zero.value) / self.sensor.range.value
        bend = sum(self.of(f"potentiometer_nonlinearity.bend_{k}") * sin(k * np.pi * x) for k in range(1, 9))
        gained = self.of("potentiometer_gain.relative") * (x - 0.5) * self.sensor.range.value
        return float(angle + gained + self.of("potentiometer_offset.offset") + bend)

    def command(self, wanted: float, before: float, shown: float) -> float:
        """Volts for an error in counts, P alone: 127 counts of power drive the motor to the supply's limit."""
        lost = self.of("lost_set_points.share")
        counts = (shown - self.sensor.at_zero.value) / (self.sensor.range.value / COUNTS)
        error = (1 - lost) * wanted + lost * before - counts
        power = GAIN * (1 + self.of("wrong_gain.relative")) * error
        return float(np.clip(power, -127, 127) * self._supply / 127)

    def volts(self, command: float) -> float:
        """At the motor: what lies outside the dead zone, within the limit; nothing up to a threshold."""
        outside = max(abs(command) - self.of("dead_zone.width"), 0.0)
        if abs(command) <= self.of("amplifier_threshold.width"):
            outside = 0.0
        return float(np.sign(command) * min(outside, self.of("supply_limit.voltage", self._supply)))

    @property
    def _supply(self) -> float:
        limit = self.model.machine.joint(self.number).dc_motor.supply_limit
        return limit.value


def _joint_numbers(model: Model, value: dict[str, float]) -> Floats:
    """(3, 38), in the order of the columns above."""
    rows = []
    for j in (1, 2, 3):
        drive, sensor = model.machine.joint(j).dc_motor, model.machine.joint(j).sensor

        def of(name: str, null: float = 0.0, j: int = j) -> float:
            return value.get(f"joint{j}.{name}", null)

        has = {use.name for use in model.effects if j in use.joints}
        gives = bool(has & {"backlash", "joint_compliance"})
        contact = of("backlash.contact", _null_contact(model, j)) if gives else 0.0
        damping = of("backlash.damping", of("joint_compliance.damping"))
        rows.append(
            [
                of("motor.resistance"),
                of("motor_inductance.inductance", 1.0),
                of("motor.torque_constant") * (1 - of("weakened_magnet.loss")),
                of("motor.back_emf_constant") * (1 - of("weakened_magnet.loss")),
                of("motor.rotor_inertia"),
                drive.gear_ratio.value,
                of("resistance_drift.heating"),
                of("resistance_drift.time_constant", 1.0),
                of("resistance_rise.rise"),
                of("resistance_rise.time_constant", 1.0),
                of("viscous_friction.coefficient"),
                of("coulomb_friction.torque"),
                of("load_dependent_friction.arm"),
                of("gravity_torque_friction.share"),
                PRESLIDING_COUNTS * sensor.range.value / COUNTS,
                of("stribeck_friction.torque"),
                of("stribeck_friction.speed", 1.0),
                of("stiction.breakaway"),
                of("direction_dependent_friction.difference"),
                of("direction_dependent_viscous_friction.difference"),
                of("quadratic_drag.coefficient"),
                of("gear_loss.loss"),
                of("direction_dependent_gear_loss.difference"),
                of("joint_compliance.compliance") + contact,
                damping,
                of("backlash.gap"),
                of("torque_ripple.sine"),
                of("torque_ripple.cosine"),
                of("torque_ripple.cycles", 1.0),
                of("spring_torque.stiffness"),
                of("spring_torque.rest"),
                of("one_sided_spring.stiffness"),
                of("one_sided_spring.rest"),
                of("constant_torque.torque"),
                of("periodic_disturbance.sine"),
                of("periodic_disturbance.cosine"),
                of("periodic_disturbance.frequency"),
                "motor_inductance" in has,
                gives,
                "stiction" in has,
            ]
        )
    return np.array(rows, dtype=np.float64)


def _null_contact(model: Model, joint: int) -> float:
    """Compliance of a contact that is not stated: rotor and link swing against each other at 1500 rad/s."""
    used = base_model(model.machine).with_effect("backlash", (joint,))
    return used.parameter(f"joint{joint}.backlash.contact").value


def _body(model: Model, value: dict[str, float]) -> Floats:
    """Inertias (I1, a2, a3, b), weights of link 2, and of link 3 with its load; first moments of both; gravity (3)."""
    lengths = [model.machine.joint(j).geometry.a.value for j in (2, 3)]
    link_1 = model.machine.joint(1).link
    assert isinstance(link_1, Cylinder)
    m1, m2, m3 = (value[f"link{j}.mass"] + value.get(f"joint{j}.link_mass.added", 0.0) for j in (1, 2, 3))
    load = value["load.mass"] + value.get("load.payload.mass", 0.0)
    c2, c3 = (a / 2 + value.get(f"joint{j}.centre_of_mass.shift", 0.0) for j, a in ((2, lengths[0]), (3, lengths[1])))
    x, y, z = 0.0, 0.0, -GRAVITY
    about_x, about_y = value.get("base.base_tilt.about_x", 0.0), value.get("base.base_tilt.about_y", 0.0)
    y, z = y * cos(about_x) + z * sin(about_x), z * cos(about_x) - y * sin(about_x)
    x, z = x * cos(about_y) - z * sin(about_y), z * cos(about_y) + x * sin(about_y)
    a2 = m2 * (lengths[0] ** 2 / 12 + c2**2) + (m3 + load) * lengths[0] ** 2
    a3 = m3 * (lengths[1] ** 2 / 12 + c3**2) + load * lengths[1] ** 2
    b = lengths[0] * (m3 * c3 + load * lengths[1])
    p2, p3 = m2 * c2 + (m3 + load) * lengths[0], m3 * c3 + load * lengths[1]
    inertia_1 = 0.5 * m1 * value["link1.radius"] ** 2
    return np.array([inertia_1, a2, a3, b, -z * m2, -z * (m3 + load), p2, p3, x, y, z])
