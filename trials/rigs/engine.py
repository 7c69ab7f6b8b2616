"""The rigs' integrator: MuJoCo's rigid bodies with separate drives, friction, gears, sensors and sampled loop.

Positions at the steps and speeds between them (leapfrog). MuJoCo gives the acceleration without drives and friction,
and solves with the mass matrix; compiled code calls both by their names in its library.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from trials.rigs.bodies import Bodies, mjcf
from trials.rigs.laws import (
    amplified,
    bristles,
    compiled,
    outside_torque,
    sensed,
    sliding_level,
    transmitted_torque,
    viscous_torque,
)
from trials.rigs.loop import LAST_ERROR, LAST_READING, LAST_WANTED, MEMORY, control, rounded
from trials.rigs.parameters import BOARD, BRISTLE, BY_CURRENT, PRESSING_WEIGHT, SWITCH, TANH, Records

Floats = NDArray[np.float64]

llvm.load_library_permanently(str(next(Path(mujoco.__file__).parent.glob("libmujoco.*"))))
_FORWARD = types.ExternalFunction("mj_forward", types.void(types.intp, types.intp))
_SOLVE = types.ExternalFunction(
    "mj_solveM", types.void(types.intp, types.intp, types.CPointer(types.f8), types.CPointer(types.f8), types.i4)
)

SWEEPS = 30
"""Most Gauss–Seidel sweeps over the joints' set-valued friction."""
AT_REST = 1e-9
"""rad/s below which a joint with set-valued friction rests."""
WHOLE = 1e-6
"""Share of a step within which a period counts as a whole number of steps."""
BREAKING_SPEED = 2e-3
"""rad/s over which bristles lose the part of static friction above sliding friction."""


@dataclass(frozen=True)
class Motion:
    """Samples (k, n) of the loop: time (k,) s, set points, readings (rad), drive, true angle and speed."""

    time: Floats
    set_point: Floats
    position: Floats
    drive: Floats
    angle: Floats
    velocity: Floats


def simulate(
    bodies: Bodies, joints: Records, loop: Records, set_points: Floats, *, noise: Floats | None = None
) -> Motion:
    """Simulates the rig under its loop from rest at the first set point.

    With `noise` (k, n; rad) readings and drives are rounded, without it the loop is smooth.

    Raises ValueError for a period that is not a whole number of steps: simulated and recorded time would differ.
    """
    rotors = tuple(float(j["rotor"]) if not j["flexible"] else 0.0 for j in joints)
    model = mujoco.MjModel.from_xml_string(mjcf(bodies, rotors))
    data = mujoco.MjData(model)
    count, n = set_points.shape
    out = np.zeros((4, count, n))
    data.qpos[:] = set_points[0]
    mujoco.mj_forward(model, data)
    hinges = np.array([model.jnt_bodyid[j] for j in range(n)], dtype=np.int64)
    beyond = np.array([bodies.beyond(j) for j in range(n)])
    weight = np.array(bodies.gravity)
    addresses = (model._address, data._address)
    views = (data.qpos, data.qvel, data.qacc, data.xaxis, data.xanchor, data.xipos, np.array(model.body_mass))
    if step_within(*(float(loop[name][0]) for name in ("period", "step"))) != loop["step"][0]:
        raise ValueError(f"a period of {loop['period'][0]} s is not a whole number of steps of {loop['step'][0]} s")
    exact = noise is not None
    disturbed = np.zeros_like(set_points) if noise is None else noise
    _run(addresses, views, hinges, beyond, weight, joints, loop[0], set_points, disturbed, exact, out)
    time = np.arange(count) * float(loop["period"][0])
    return Motion(time, set_points, out[0], out[1], out[2], out[3])


def step_within(period: float, step: float) -> float:
    """Returns the step, s, or a near one that divides a period, s, so that simulated and recorded time are equal."""
    steps = max(1, round(period / step))
    return step if abs(period / step - steps) < WHOLE else period / steps


@compiled
def _presses(j: int, axis: Floats, anchor: Floats, places: Floats, masses: Floats, first: int, gravity: Floats) -> Any:
    """Returns gravity's torque about joint j, N·m, of the bodies from `first` on."""
    torque = 0.0
    for b in range(first, masses.size):
        x, y, z = places[b, 0] - anchor[j, 0], places[b, 1] - anchor[j, 1], places[b, 2] - anchor[j, 2]
        about_x = y * gravity[2] - z * gravity[1]
        about_y = z * gravity[0] - x * gravity[2]
        about_z = x * gravity[1] - y * gravity[0]
        torque += masses[b] * (axis[j, 0] * about_x + axis[j, 1] * about_y + axis[j, 2] * about_z)
    return torque


@compiled
def _across(axis: Floats, j: int, gravity: Floats) -> float:
    """Returns the magnitude of gravity across the axis of joint j, m/s²."""
    along = axis[j, 0] * gravity[0] + axis[j, 1] * gravity[1] + axis[j, 2] * gravity[2]
    square = gravity[0] ** 2 + gravity[1] ** 2 + gravity[2] ** 2 - along * along
    return math.sqrt(max(square, 0.0))


@compiled
def _within_volts(command: float, speed: float, p: Any) -> float:
    """Returns the part of a current loop's command (N·m of the motor) that its volts allow; back-EMF helps when it
    brakes."""
    back = p.back_emf * p.gear * speed
    share = p.nominal_constant / p.resistance
    return min(max(command, share * (-p.supply - back)), share * (p.supply - back))


@compiled
def _motor_torque(volts: float, current: float, speed: float, rise: float, p: Any, step: float) -> Any:
    """Returns the current (A) after a step and the torque (N·m) at the joint; `volts` is the command of a current loop
    in N·m."""
    if p.current_rate > 0.0:
        wished = _within_volts(volts, speed, p) / p.nominal_constant
        current = wished + (current - wished) * math.exp(-p.current_rate * step)
    else:
        resistance = p.resistance * (1.0 + rise)
        settled = (volts - p.back_emf * p.gear * speed) / resistance
        kept = math.exp(-resistance * step / p.inductance) if p.inductance > 0.0 else 0.0
        current = settled + (current - settled) * kept
    return current, p.gear * p.torque_constant * current


@compiled
def _rub(push: Floats, answer: Floats, level: Floats, switched: Any, rub: Floats, step: float) -> None:
    """Computes set-valued friction: `rub` (N·m) within ±level that stops each joint if it can.

    `push` is the speed after the step without it, `answer` M⁻¹.
    """
    n = push.size
    for _ in range(SWEEPS):
        change = 0.0
        for j in range(n):
            if not switched[j]:
                continue
            speed = push[j]
            for i in range(n):
                if switched[i]:
                    speed += step * answer[j, i] * rub[i]
            wished = rub[j] - speed / (step * answer[j, j])
            wished = min(max(wished, -level[j]), level[j])
            change = max(change, abs(wished - rub[j]))
            rub[j] = wished
        if change < 1e-12:
            break


@compiled
def _run(  # noqa: PLR0912, PLR0915
    addresses: Any,
    views: Any,
    hinges: Any,
    beyond: Floats,
    gravity: Floats,
    joints: Records,
    loop: Any,
    set_points: Floats,
    noise: Floats,
    exact: bool,
    out: Floats,
) -> None:
    model, data = addresses
    q, v, free, axis, anchor, places, masses = views
    n, h = q.size, loop.step
    steps = int(rounded(loop.period / h))
    late, share = np.zeros(n, dtype=np.int64), np.zeros(n)
    for j in range(n):
        lateness = (loop.delay + joints[j].extra_delay) / h
        late[j] = int(rounded(lateness))
        share[j] = late[j] + 0.5 - lateness  # of the half step before and after the position, in which a drive changes
    waits = late.max() // steps + 2
    memory = np.zeros((n, MEMORY))
    waiting = np.zeros((waits, n))
    drive, current, rise, z, rest_time = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    motor, motor_speed, torque, push, level, rub = (
        q.copy(),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
    )
    unit, answer = np.eye(n), np.zeros((n, n))
    switched = np.zeros(n, dtype=np.bool_)
    for j in range(n):
        memory[j, LAST_WANTED] = set_points[0, j]
        switched[j] = joints[j].contact == SWITCH
    for k in range(set_points.shape[0]):
        for j in range(n):
            p = joints[j]
            read = sensed(q[j], p) + noise[k, j]
            if exact:
                read = p.at_zero + p.count * rounded((read - p.at_zero) / p.count)
            if k == 0:
                memory[j, LAST_READING] = read
                error = set_points[0, j] - read
                memory[j, LAST_ERROR] = error / p.count if loop.controller == BOARD else error
            out[0, k, j] = read
            out[1, k, j] = control(set_points[k, j], read, p, loop, exact, memory[j])
            out[2, k, j] = q[j]
            waiting[k % waits, j] = out[1, k, j]
        for s in range(steps):
            now = k * steps + s
            time = now * h
            _FORWARD(model, data)
            _SOLVE(model, data, answer.ctypes, unit.ctypes, np.int32(n))
            for j in range(n):
                p = joints[j]
                command = drive[j]
                if now >= late[j] and (now - late[j]) % steps == 0:
                    drive[j] = waiting[(now - late[j]) // steps % waits, j]
                    command += share[j] * (drive[j] - command)
                passed = command if p.current_rate > 0.0 else amplified(command, p)
                side = motor_speed[j] if p.flexible != 0.0 else v[j]
                current[j], driving = _motor_torque(passed, current[j], side, rise[j], p, h)
                if p.heating > 0.0:
                    heat = p.heating * (current[j] ** 2 if p.heat_law == BY_CURRENT else 1.0)
                    rise[j] += h * (heat - rise[j] / p.cooling_time)
                carried = driving
                if p.flexible != 0.0:
                    carried = transmitted_torque(motor[j] - q[j], motor_speed[j] - v[j], p)
                    motor_speed[j] += h * (driving - carried) / p.rotor
                    motor[j] += h * motor_speed[j]
                load = 0.0
                if p.load_arm != 0.0:
                    if p.load_law == PRESSING_WEIGHT:
                        load = p.load_arm * beyond[j] * _across(axis, j, gravity)
                    else:
                        load = p.load_arm * abs(_presses(j, axis, anchor, places, masses, hinges[j], gravity))
                level[j] = sliding_level(q[j], v[j], load, carried, p)
                torque[j] = carried + viscous_torque(v[j], p) + outside_torque(time, q[j], p)
                if p.contact == TANH:
                    torque[j] -= level[j] * math.tanh(v[j] / p.sign_width)
                elif p.contact == BRISTLE:
                    hold = level[j] + p.breakaway * math.exp(-((v[j] / BREAKING_SPEED) ** 2))
                    after = bristles(z[j], v[j], hold, p.bristle, h)
                    torque[j] -= p.bristle * after + p.bristle_damping * (after - z[j]) / h
                    z[j] = after
                elif p.breakaway > 0.0:
                    resting = abs(v[j]) < AT_REST
                    rest_time[j] = rest_time[j] + h if resting else 0.0
                    if resting:
                        level[j] += p.breakaway * (1.0 - math.exp(-rest_time[j] / p.dwell))
            for j in range(n):
                push[j] = v[j] + h * free[j]
                for i in range(n):
                    push[j] += h * answer[j, i] * torque[i]
            _rub(push, answer, level, switched, rub, h)
            for j in range(n):
                after = push[j]
                for i in range(n):
                    if switched[i]:
                        after += h * answer[j, i] * rub[i]
                if s == 0:
                    out[3, k, j] = 0.5 * (v[j] + after)
                v[j] = after
                q[j] += h * after
