"""The 4-3-4 trajectory of a pick-and-place task, with lift-off and set-down points (section 3.7.2 of the source)."""

from __future__ import annotations

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import PickAndPlace
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.trajectories.kinematics import link_ends
from daq.trajectories.piece import Piece, periods_in, require_sampled, sample_times, smooth_piece
from daq.trajectories.set_points import Mark

LEAST_LIFT = 0.25
"""Least height of the lift-off and set-down points, as a share of the last link's length (Paul 1972, in section
3.7.2)."""
ORDERS = (4, 3, 4)
"""Orders of the polynomials for picking (3.54), travelling (3.45) and placing (3.54)."""
CLOSE = 1e-6
"""Largest distance (m) of the arm's end from a lifted point: a thousandth of the sensors' resolution."""
ITERATIONS = 50
LARGEST_TURN = 0.2
"""Largest change (rad) of a joint per iteration."""


def pick_and_place(
    move: PickAndPlace, machine: Machine, joints: tuple[int, ...], start: Floats, amplitudes: Floats, period: float
) -> Piece:
    """Moves from `start` (all joints of the machine, rad) through `amplitudes` (k,) rad of `joints`, lifted at both
    ends.

    Raises SpecError for a lift below LEAST_LIFT, for a lift that these joints cannot make, and for durations too short
    for the control period.
    """
    durations = np.array([move.pick, move.travel, move.place])
    for name, duration in zip(("pick", "travel", "place"), durations.tolist(), strict=True):
        require_sampled(duration, period, f"pick and place: {name}")
    least = LEAST_LIFT * last_link(machine)
    if move.lift < least:
        raise SpecError(
            f"pick and place: lift of {move.lift:g} m: allowed are {least:.4f} m and more, a quarter of the last link"
        )
    columns = [joint - 1 for joint in joints]
    end = start.copy()
    end[columns] += amplitudes
    lift_off, set_down = (lift_posture(machine, posture, joints, move.lift) for posture in (start, end))
    postures = (start, lift_off, set_down, end)
    knots = np.stack([posture[columns] - start[columns] for posture in postures])
    time = sample_times(float(durations.sum()), period)
    marks = (
        Mark(0, "ramp_start", "picking starts"),
        Mark(periods_in(move.pick, period), "waypoint", "lift-off point"),
        Mark(periods_in(move.pick + move.travel, period), "waypoint", "set-down point"),
        Mark(len(time), "ramp_end", "placed"),
    )
    return smooth_piece(evaluate(polynomials(knots, durations), durations, time), marks)


def polynomials(knots: Floats, durations: Floats) -> list[Floats]:
    """Coefficients, lowest order first, of the three polynomials, each over its own time from 0 to 1.

    `knots` (4, k): initial, lift-off, set-down and final point; `durations` (3,) s. Speed and acceleration are 0 at
    both ends; position, velocity and acceleration are continuous in between: 14 conditions for 5 + 4 + 5 coefficients.
    """
    sizes = [order + 1 for order in ORDERS]
    first = np.concatenate([[0], np.cumsum(sizes)])
    rows, wanted = [], []

    def row(*parts: tuple[int, float, int, float]) -> Floats:
        """Row of the equation system: the sum of derivatives, each given as (piece, at 0 or 1, derivative, sign), in
        s."""
        made = np.zeros(first[-1])
        for piece, at, derivative, sign in parts:
            monomials = np.polynomial.polynomial.polyvander(np.array([at]), sizes[piece] - 1)[0]
            powers = np.eye(sizes[piece])
            for _ in range(derivative):
                powers = np.stack([np.append(np.polynomial.polynomial.polyder(one), 0.0) for one in powers])
            made[first[piece] : first[piece + 1]] += sign * (powers @ monomials) / durations[piece] ** derivative
        return made

    for piece in range(3):
        rows += [row((piece, 0.0, 0, 1.0)), row((piece, 1.0, 0, 1.0))]
        wanted += [knots[piece], knots[piece + 1]]
    for derivative in (1, 2):
        rows += [row((0, 0.0, derivative, 1.0)), row((2, 1.0, derivative, 1.0))]
        rows += [row((p, 1.0, derivative, 1.0), (p + 1, 0.0, derivative, -1.0)) for p in (0, 1)]
        wanted += [np.zeros(knots.shape[1])] * 4
    # Durations of different orders of magnitude would give columns of very different sizes.
    matrix = np.stack(rows)
    sizes_of_rows = np.abs(matrix).max(axis=1, keepdims=True)
    found = np.linalg.solve(matrix / sizes_of_rows, np.stack(wanted) / sizes_of_rows)
    return [found[first[piece] : first[piece + 1]] for piece in range(3)]


def evaluate(pieces: list[Floats], durations: Floats, time: Floats, derivative: int = 0) -> Floats:
    """Evaluates the pieces in order, or their time derivative, at `time` (n,) s: (n, k)."""
    begins = np.concatenate([[0.0], np.cumsum(durations)])
    which = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, 2)
    found = np.empty((len(time), pieces[0].shape[1]))
    for number, coefficients in enumerate(pieces):
        own = which == number
        part = np.clip((time[own] - begins[number]) / durations[number], 0.0, 1.0)
        made = np.polynomial.polynomial.polyder(coefficients, derivative) if derivative else coefficients
        found[own] = np.polynomial.polynomial.polyval(part, made).T / durations[number] ** derivative
    return found


def last_link(machine: Machine) -> float:
    """Length (m) of the last link with a length. Raises SpecError for a machine without one."""
    lengths = [max(abs(joint.geometry.a.value), abs(joint.geometry.d.value)) for joint in machine.joints]
    length = next((length for length in reversed(lengths) if length > 0), 0.0)
    if length == 0:
        raise SpecError(f"machine {machine.name}: its links have no length, so nothing can be lifted")
    return length


def lift_posture(machine: Machine, posture: Floats, joints: tuple[int, ...], height: float) -> Floats:
    """Returns the posture (all joints, rad) near `posture` whose end is `height` m higher, moving only `joints`.

    Uses Newton's method on the forward kinematics, and least squares for redundant joints. Raises SpecError if these
    joints cannot lift the end straight up by that much.
    """
    columns = [joint - 1 for joint in joints]
    found = posture.copy()
    target = _end(machine, posture) + np.array([0.0, 0.0, height])
    for _ in range(ITERATIONS):
        left = target - _end(machine, found)
        if float(np.linalg.norm(left)) < CLOSE:
            return found
        slopes = np.stack([_slope(machine, found, column) for column in columns], axis=1)
        turn = np.linalg.lstsq(slopes, left, rcond=1e-6)[0]
        found[columns] += turn * min(1.0, LARGEST_TURN / max(float(np.abs(turn).max()), 1e-12))
    at = ", ".join(f"{np.degrees(angle):.0f}°" for angle in posture[columns])
    raise SpecError(
        f"pick and place: joints {', '.join(map(str, joints))} at {at} cannot lift the arm's end straight up by "
        f"{height:g} m: begin where the elbow is bent (a stretched arm cannot reach higher), on joints 2 and 3 at least"
    )


def _end(machine: Machine, posture: Floats) -> Floats:
    return np.asarray(link_ends(machine, posture[None, :])[0, -1], dtype=np.float64)


def _slope(machine: Machine, posture: Floats, column: int, step: float = 1e-6) -> Floats:
    """(3,) m/rad: derivative of the end's position with respect to one joint."""
    ahead, behind = posture.copy(), posture.copy()
    ahead[column] += step
    behind[column] -= step
    return (_end(machine, ahead) - _end(machine, behind)) / (2 * step)
