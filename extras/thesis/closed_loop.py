"""Simulates an arm under a control law in continuous time: RK4 over position, speed and the integral of the error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from daq.contracts.errors import SpecError
from extras.thesis import driven_arm as at
from extras.thesis.driven_arm import DrivenArm, equation_of_motion
from model.arrays import Floats
from model.dynamics.compilation import compiled
from model.dynamics.linear_solve import solve_3

LONGEST_STEP = 2e-4
"""Longest integration step, s; half of it changes no position of chapter 8's runs by more than 1e-5 rad (tests)."""

PARTITIONED_GAINS = (11.0, 5.0, 7.0)
"""K_P, K_I, K_D of every joint, (8.17) to (8.19): poles at −1, −1 and −5 on a unit inertia."""

PID_GAINS = ((25.4, 5.2, 21.9), (29.2, 3.8, 23.6), (22.8, 4.8, 21.7))
"""K_P, K_I, K_D of joints 1 to 3 of the classical PID (section 8.3), volts at the amplifier's input per rad."""

AMPLIFIER_GAIN = 28.0
"""Gain between the controller's output and the motor (section 6.2); by (8.5) and (8.7) it is part of the PID's loop."""


@dataclass(frozen=True)
class Sinusoid:
    """θ_d = centre + amplitude · sin(2π t / period + phase) on each of three joints, rad and s."""

    centre: tuple[float, float, float]
    amplitude: tuple[float, float, float]
    period: float
    phase: tuple[float, float, float]

    def table(self) -> Floats:
        """(4, 3) centre, amplitude, angular frequency, phase."""
        return np.array([self.centre, self.amplitude, [2 * np.pi / self.period] * 3, self.phase])

    def at(self, time: Floats) -> Floats:
        """Returns desired positions (k, 3) at times (k,)."""
        centre, amplitude, rate, phase = self.table()
        return np.asarray(centre + amplitude * np.sin(np.outer(time, rate) + phase))


@dataclass(frozen=True)
class Partitioned:
    """Control by the inverse dynamics of a model (8.12): linear and decoupled as far as the model is right."""

    model: DrivenArm
    gains: tuple[float, float, float] = PARTITIONED_GAINS


@dataclass(frozen=True)
class ClassicalPid:
    """PID with fixed gains for each joint; `amplifier` multiplies its output before the motor."""

    gains: tuple[tuple[float, float, float], ...] = PID_GAINS
    amplifier: float = AMPLIFIER_GAIN


@dataclass(frozen=True)
class ControlledMotion:
    """time (k,) s; wanted, position (k, 3) rad; velocity rad/s; volts (k, 3) at the motors."""

    time: Floats
    wanted: Floats
    position: Floats
    velocity: Floats
    volts: Floats


def control(
    plant: DrivenArm,
    law: Partitioned | ClassicalPid,
    wanted: Sinusoid,
    start: tuple[float, float, float],
    duration: float,
    *,
    start_speed: tuple[float, float, float] = (0.0, 0.0, 0.0),
    every: int = 50,
    step: float = LONGEST_STEP,
) -> ControlledMotion:
    """Returns the motion of `plant` under `law`, from `start` (rad) with `start_speed` (rad/s); every `every`-th step
    is kept.

    The amplifier is linear and without limit, as in the source.

    Raises:
        SpecError: for a duration that is not positive, or if the motion does not stay finite.
    """
    if not (np.isfinite(duration) and duration > 0):
        raise SpecError(f"duration {duration} s: must be positive")
    gains, estimate = np.zeros((3, 3)), np.zeros(at.SIZE)
    if isinstance(law, Partitioned):
        gains[:], estimate = law.gains, law.model.vector()
    else:
        gains[:] = law.amplifier * np.array(law.gains)
    kept = round(duration / (step * every)) + 1
    out = np.zeros((kept, 4, 3))
    state = np.zeros((3, 3))
    state[0], state[1] = start, start_speed
    _run(plant.vector(), estimate, gains, isinstance(law, Partitioned), wanted.table(), state, step, every, out)
    if not np.isfinite(out).all():
        raise SpecError("the controlled motion does not stay finite: the control loop is unstable at these gains")
    time = np.asarray(step * every * np.arange(kept), dtype=np.float64)
    return ControlledMotion(time, *(np.ascontiguousarray(out[:, k]) for k in range(4)))


@compiled
def _run(
    plant: Floats,
    estimate: Floats,
    gains: Floats,
    partitioned: bool,
    reference: Floats,
    state: Floats,
    step: float,
    every: int,
    out: Floats,
) -> None:
    for k in range(out.shape[0]):
        for i in range(every):
            t = (k * every + i) * step
            k1, volts = _derivative(t, state, plant, estimate, gains, partitioned, reference)
            if i == 0:
                for j in range(3):
                    out[k, 0, j] = reference[0, j] + reference[1, j] * np.sin(reference[2, j] * t + reference[3, j])
                    out[k, 1, j], out[k, 2, j], out[k, 3, j] = state[0, j], state[1, j], volts[j]
                if k == out.shape[0] - 1:
                    break
            k2, _ = _derivative(t + 0.5 * step, state + 0.5 * step * k1, plant, estimate, gains, partitioned, reference)
            k3, _ = _derivative(t + 0.5 * step, state + 0.5 * step * k2, plant, estimate, gains, partitioned, reference)
            k4, _ = _derivative(t + step, state + step * k3, plant, estimate, gains, partitioned, reference)
            state += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@compiled
def _derivative(
    t: float, state: Floats, plant: Floats, estimate: Floats, gains: Floats, partitioned: bool, reference: Floats
) -> Any:
    """Returns rates of (position, speed, integral of the error) (3, 3), and motor volts (3)."""
    q, v = state[0], state[1]
    error, rate_error, wanted_acceleration = np.empty(3), np.empty(3), np.empty(3)
    for j in range(3):
        angle = reference[2, j] * t + reference[3, j]
        error[j] = reference[0, j] + reference[1, j] * np.sin(angle) - q[j]
        rate_error[j] = reference[1, j] * reference[2, j] * np.cos(angle) - v[j]
        wanted_acceleration[j] = -reference[1, j] * reference[2, j] ** 2 * np.sin(angle)
    volts = gains[:, 0] * error + gains[:, 1] * state[2] + gains[:, 2] * rate_error
    if partitioned:
        command = volts + wanted_acceleration
        d, rest = equation_of_motion(q, v, estimate)
        volts[0] = d[0] * command[0] + d[1] * command[1] + d[2] * command[2] + rest[0]
        volts[1] = d[1] * command[0] + d[3] * command[1] + d[4] * command[2] + rest[1]
        volts[2] = d[2] * command[0] + d[4] * command[1] + d[5] * command[2] + rest[2]
        for j in range(3):
            volts[j] /= estimate[at.VOLTS_TO_TORQUE + j]
    d, rest = equation_of_motion(q, v, plant)
    a1, a2, a3 = solve_3(
        d[0],
        d[1],
        d[2],
        d[3],
        d[4],
        d[5],
        plant[at.VOLTS_TO_TORQUE] * volts[0] - rest[0],
        plant[at.VOLTS_TO_TORQUE + 1] * volts[1] - rest[1],
        plant[at.VOLTS_TO_TORQUE + 2] * volts[2] - rest[2],
    )
    rates = np.empty((3, 3))
    rates[0], rates[1], rates[2] = v, np.array([a1, a2, a3]), error
    return rates, volts
