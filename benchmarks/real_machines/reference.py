"""The reference: linear least squares on the inverse dynamics, with the usual regressors, by numpy alone.

Torques are linear in every link's mass, first moments and inertia about its frame, in the rotor's inertia, in the
coefficients of viscous and Coulomb friction, and in an offset. Signals are low-passed by the gain of a Butterworth
filter that runs forwards and backwards, applied to the spectrum. Samples at which a joint rests are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_machines.records import machine_data

Floats = NDArray[np.float64]

WIDER = 3.0
"""Cutoff of the motion's low-pass, as a multiple of that of the torques."""
GRID = 3.0
"""Compared samples per period of the cutoff, as in the product: closer ones are not independent."""
PADDED = 1.0
"""Seconds by which signals are mirrored at their ends."""
LEAST = 0.01
"""Least singular value, as a share of the largest: base parameters that a motion hardly excites are left out (Gautier
requires a condition number below 100). On six joints, a fit of all of them has twice the error elsewhere.
"""
EDGE = 1.0
"""Periods of the cutoff that are left out at both ends."""
RESTS = 0.01
"""Speed below which a joint rests, as a share of the largest of the record: friction then balances any torque."""


@dataclass(frozen=True)
class Reference:
    """Result of a linear fit: √(Σ residual² / Σ torque²) on fitted and on held-out records, and its number of
    columns.
    """

    fitted: float
    held_out: float
    columns: int


def reference(
    machine: Path,
    fitted: Sequence[Mapping[str, Floats]],
    held_out: Sequence[Mapping[str, Floats]],
    cutoff: float,
    *,
    offset: bool,
) -> Reference:
    """Fits the linear model. cutoff in Hz, of torques. offset: whether every joint has a constant torque, too."""
    document = machine_data(machine)
    first, second = (
        [_system(document, columns, cutoff, offset=offset) for columns in records] for records in (fitted, held_out)
    )
    A, b, moves = (np.concatenate([system[part] for system in first]) for part in range(3))
    size = np.linalg.norm(A, axis=(0, 1))
    used = size > 1e-12 * size.max()
    weight = moves / np.sqrt(
        (b**2 * moves).sum(axis=0) / moves.sum(axis=0)
    )  # joints have equal weight, whatever their torques
    rows = (A[:, :, used] / size[used]) * weight[:, :, None]
    found = np.linalg.lstsq(rows.reshape(-1, int(used.sum())), (b * weight).ravel(), rcond=LEAST)[0] / size[used]

    def left(systems: Sequence[tuple[Floats, Floats, Floats]]) -> float:
        over = sum(
            float(((torque - columns[:, :, used] @ found) ** 2 * kept).sum()) for columns, torque, kept in systems
        )
        return float(np.sqrt(over / sum(float((torque**2 * kept).sum()) for _, torque, kept in systems)))

    return Reference(left(first), left(second), int(used.sum()))


def _system(
    document: Mapping[str, Any], columns: Mapping[str, Floats], cutoff: float, *, offset: bool
) -> tuple[Floats, Floats, Floats]:
    """Returns regressors (m, n, p), torques (m, n) and where a joint moves, 0 or 1 (m, n), of one record."""
    joints = document["joints"]
    names = range(1, len(joints) + 1)
    time = columns["time"]
    period = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], period)

    def even(key: str) -> Floats:
        return np.stack([np.interp(grid, time, columns[f"{key}_{j}"]) for j in names], axis=1)

    wide = min(WIDER * cutoff, 0.4 / period)
    speed = even("velocity") if "velocity_1" in columns else None
    position = even("position") if "position_1" in columns else np.cumsum(speed, axis=0) * period  # type: ignore[arg-type]
    position = _low_pass(position, wide, period)
    speed = np.gradient(position, period, axis=0) if speed is None else _low_pass(speed, wide, period)
    acceleration = np.gradient(speed, period, axis=0)
    torque = even("drive") * np.array([gain_of(joint["drive"]) for joint in joints])
    own = [acceleration, speed, np.sign(speed), *([np.ones_like(speed)] if offset else [])]
    diagonal = [np.einsum("mj,jk->mjk", signal, np.eye(len(joints))) for signal in own]
    A = np.concatenate([_bodies(document, position, speed, acceleration), *diagonal], axis=2)
    edge = round(EDGE / cutoff / period)
    kept = slice(edge, -edge, max(1, round(1 / (GRID * cutoff * period))))
    moves = (np.abs(speed) > RESTS * np.abs(speed).max(axis=0)).astype(np.float64)
    passed = _low_pass(A.reshape(len(grid), -1), cutoff, period).reshape(A.shape)
    return passed[kept], _low_pass(torque, cutoff, period)[kept], moves[kept]


def gain_of(drive: Mapping[str, Any]) -> float:
    """Returns torque at the joint per unit of drive, of a motor at rest."""
    if drive["kind"] == "gain":
        return float(drive["gain"]["value"])
    number = {key: drive[key]["value"] for key in ("gear_ratio", "torque_constant", "resistance")}
    return float(number["gear_ratio"] * number["torque_constant"] / number["resistance"])


def _low_pass(signal: Floats, cutoff: float, period: float) -> Floats:
    """Low-passes columns (k, …) without delay."""
    pad = min(len(signal) - 1, round(PADDED / period))
    ends = 2 * signal[0] - signal[pad:0:-1], 2 * signal[-1] - signal[-2 : -pad - 2 : -1]
    whole = np.concatenate([ends[0], signal, ends[1]])
    frequency = np.fft.rfftfreq(len(whole), period)
    passed = 1 / (1 + (frequency / cutoff) ** 8)
    return np.fft.irfft(np.fft.rfft(whole, axis=0) * passed[:, None], len(whole), axis=0)[pad : pad + len(signal)]


def _bodies(document: Mapping[str, Any], q: Floats, v: Floats, a: Floats) -> Floats:
    """Returns regressors (k, n, 10 n): mass, first moments and inertia of every link about its own frame.

    Recursive Newton–Euler with standard Denavit–Hartenberg frames.
    """
    joints = document["joints"]
    n, k = len(joints), len(q)
    up = np.array([0.0, 0.0, 1.0])
    omega, alpha = np.zeros((k, 3)), np.zeros((k, 3))
    lift = np.tile(-np.array(document["gravity"]), (k, 1))
    turns, arms, wrenches = [], [], []
    for i, joint in enumerate(joints):
        geometry = {key: joint["geometry"][key]["value"] for key in ("a", "alpha", "d", "theta")}
        slides = joint["kind"] == "prismatic"
        theta = np.full(k, geometry["theta"]) if slides else q[:, i] + geometry["theta"]
        d = q[:, i] + geometry["d"] if slides else np.full(k, geometry["d"])
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(geometry["alpha"]), np.sin(geometry["alpha"])
        zero = np.zeros(k)
        turn = np.stack(
            [
                np.stack([c, -s * ca, s * sa], 1),
                np.stack([s, c * ca, -c * sa], 1),
                np.stack([zero, zero + sa, zero + ca], 1),
            ],
            axis=1,
        )
        arm = np.stack([zero + geometry["a"], d * sa, d * ca], axis=1)
        back = np.swapaxes(turn, 1, 2)
        if not slides:
            alpha = alpha + a[:, i, None] * up + np.cross(omega, v[:, i, None] * up)
            omega = omega + v[:, i, None] * up
        else:
            lift = lift + a[:, i, None] * up + 2 * np.cross(omega, v[:, i, None] * up)
        omega, alpha, lift = (np.einsum("kab,kb->ka", back, x) for x in (omega, alpha, lift))
        lift = lift + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
        turns.append(turn)
        arms.append(arm)
        wrenches.append(_wrench(omega, alpha, lift))
    found = np.zeros((k, n, 10 * n))
    for link in range(n):
        force, moment = wrenches[link]
        for i in range(link, -1, -1):
            moment = moment + np.cross(arms[i][:, :, None], force, axis=1)
            force, moment = (np.einsum("kab,kbp->kap", turns[i], x) for x in (force, moment))
            slides = joints[i]["kind"] == "prismatic"
            found[:, i, 10 * link : 10 * link + 10] = (force if slides else moment)[:, 2]
    return found


def _wrench(omega: Floats, alpha: Floats, lift: Floats) -> tuple[Floats, Floats]:
    """Returns force and moment (k, 3, 10) about a link's frame for one unit of each of its ten parameters."""
    k = len(omega)
    force, moment = np.zeros((k, 3, 10)), np.zeros((k, 3, 10))
    force[:, :, 0] = lift
    for axis, unit in enumerate(np.eye(3)):
        force[:, :, 1 + axis] = np.cross(alpha, unit) + np.cross(omega, np.cross(omega, unit))
        moment[:, :, 1 + axis] = np.cross(unit, lift)
    for column, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)), start=4):
        tensor = np.zeros((3, 3))
        tensor[i, j] = tensor[j, i] = 1.0
        moment[:, :, column] = alpha @ tensor + np.cross(omega, omega @ tensor)
    return force, moment
