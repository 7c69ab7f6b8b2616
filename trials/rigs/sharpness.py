"""Computes from the truth which laws of a library the training record of a rig can distinguish.

A rival is the healthy arm with another effect, in its plainest law. Its sizes and all parameters that the file states
with a deviation are refitted by least squares to the readings of the true arm, in the rigs' own simulation without
noise or rounding. χ² has two parts: the residual over the variance of the noise, and the cost of the file's parameters.
Each is stated with a deviation, as a share of itself. It costs the square of its logarithmic distance from the stated
value, in these deviations; the cost of the true arm's parameters is subtracted. No file states that a parameter is
never farther off than rigs are drawn with, so the judge does not know that either (docs/decisions/0053). d′ of a rival
is √(χ² of the rival − χ² of the effect's own plainest law), and that of `none` is √χ² of the healthy arm. Below 5
record and file do not distinguish. The file counts as it is: friction of twice its stated value, with a
stated deviation of 30 %, may belong to a healthy arm with an unlucky file, whatever the true friction without the
effect.

With several effects, d′ of each is that of the arm without it, with the others present; rivals are computed for single
effects only. A rival that no rig can hide counts as no nearer than the healthy arm.

This version leaves out:
- rivals on other joints than the effect's; held-out records; recorded speeds;
- the closed loop hides a part of the information in a recorded drive, so d′ is rather too small; coloured noise counts
  as white with its density at low frequencies, outliers do not count;
- sizes are searched from a few starts, with linear tolerances, before tolerances are refitted, and the refit ends after
  some steps. Every trial is an upper bound of the least χ². So d′ of `none` may be too large, and d′ of a rival wrong
  in either direction, since the result for the effect itself is subtracted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from trials.rigs.bodies import Bodies, Link
from trials.rigs.drawing import generator
from trials.rigs.engine import Floats, simulate, step_within
from trials.rigs.hiding import IN_NO_LIBRARY, WHOLE_MACHINE, drawn, effects_of, find_drawn_law, hide, joints_of
from trials.rigs.parameters import Records
from trials.rigs.recorded_rig import COLOURED_CORNER, TRAINING, wanted, without_settling
from trials.rigs.rig import Rig, Tolerance

STEP = 2e-4
"""s, about, of the simulations here."""
DECIDES = 1e5
"""d′ by linear tolerances above which they are not refitted: no tolerance brings it below 5. It is large, because a
sticking joint is very nonlinear: friction that the file may state has reached 4 399 by linear tolerances."""
NOT_TOLD = 4.9
"""d′ at which a refit of tolerances ends, since the record does not distinguish."""
REFITTED = 40
"""Most steps of a refit of tolerances."""
DERIVATIVES = 2
"""How often a refit recomputes its derivatives when it makes no more progress."""
FARTHEST = 3.0
"""Largest initial deviations of a refit."""
TELLS = 5.0
"""d′ at which record and file distinguish. One value that is wrong by as many deviations costs as much, so none is
moved farther."""
DIFFERENCE = 0.05
"""Step of differences in a refit, deviations."""
LEAST_FALL = 1e-3
"""Share by which a step must lower χ² for its derivatives to be kept."""
EVALUATIONS = 6
"""Most refits of sizes, after the starts."""
STARTS = (0.2, 0.6, 1.6)
"""Initial sizes, over a drawn one of a hidden effect."""
SIGNED = (
    "ripple",
    "disturbance",
    "direction",
    "sensor_gain",
    "sensor_offset",
    "bend",
    "spring",
    "shift",
    "gain_error",
    "load",
    "mass",
)
"""Sizes that may have either sign."""
SHIFTED = ("ripple_phase", "disturbance_phase", "spring_rest", "about_x", "about_y")
"""Sizes that are shifted, not multiplied: by `MOVED` rad per unit."""
MOVED = 0.5
LARGEST = 30.0
"""Largest size, over a drawn one."""
KEPT = ("current", "duration", "cooling_time")
"""Sizes that are not refitted, because little depends on them, as on the stiffness of a contact behind a gap."""


@dataclass(frozen=True)
class Rival:
    """`none` is the healthy arm, `own` the effect itself in its plainest law."""

    name: str
    d_prime: float


def sharpness(rig: Rig, names: Collection[str] | None = None) -> list[Rival]:
    """Returns rivals of the one effect of a rig; empty unless there is exactly one.

    names: library names of the rivals; None for all that can be hidden in the rig.
    """
    if len(rig.hidden) != 1:
        return []
    return _Comparison(rig).rivals(effects_of(rig) if names is None else names)


def detectability(rig: Rig) -> list[float]:
    """Returns d′ of each hidden effect: between the arm without it and the arm."""
    return [_Comparison(rig, k).rivals(())[0].d_prime for k in range(len(rig.hidden))]


def _without(rig: Rig, effect: int) -> Rig:
    """Returns the rig without one of its hidden effects."""
    left = replace(rig, joints=rig.sound_joints.copy(), bodies=rig.sound, hidden=())
    for k, hidden in enumerate(rig.hidden):
        if k != effect:
            left = hide(left, hidden.name, hidden.joint, hidden.law, hidden.sizes)
    return left


class _Comparison:
    """The true arm's readings, and the tolerances that can reduce a difference from them without one of its effects."""

    def __init__(self, rig: Rig, effect: int = 0) -> None:
        self.rig = rig
        self.sound = _without(rig, effect)
        self.asked = wanted(rig, TRAINING)
        self.sigma = _noise(rig)
        self.shares = np.array([t.share for t in rig.tolerances])
        self.factors = np.array([t.factor for t in rig.tolerances])
        factors = (self.factors * np.exp(off * self.shares) for off in (-TELLS, TELLS))
        self.least, self.most = ((factor - 1.0) / self.shares for factor in factors)
        self.own_cost = _square(self._off(np.zeros(self.shares.size)))
        self.true = self._readings(rig.bodies, rig.joints, rig.loop)
        self.motion = simulate(self.sound.bodies, self.sound.joints, _loop(rig.loop), self.asked)
        # Tolerances are linearised about the true arm: the healthy arm's own parameters vary in it.
        columns = []
        for tolerance in rig.tolerances:
            ends = [self._readings(*moved(rig, {tolerance: sign * 0.5 * tolerance.share})) for sign in (1.0, -1.0)]
            columns.append(ends[0] - ends[1])
        self.answers = np.column_stack(columns) if columns else np.zeros((self.true.size, 0))
        count = self.answers.shape[1]
        self.basis, self.triangle = np.linalg.qr(np.vstack([self.answers, np.eye(count)]))

    def rivals(self, names: Collection[str]) -> list[Rival]:
        hidden = self.rig.hidden[0]
        none = self._least(lambda _: self.sound, 0, ())
        own, known_as = 0.0, hidden.known_as or hidden.name
        found = [Rival("none", math.sqrt(none))]
        if names and hidden.law != 0 and hidden.in_library and known_as == hidden.name:
            own = self._fitted(hidden.name, 0, hidden.joint)
        found.append(Rival("own", math.sqrt(own)))
        for known in names:
            name, law = find_drawn_law(known)
            if name in IN_NO_LIBRARY or known == known_as:
                continue
            if name not in effects_of(self.rig):
                found.append(Rival(known, math.sqrt(none)))
                continue
            places = joints_of(self.rig, name)
            if name not in WHOLE_MACHINE and hidden.joint is not None:
                places = tuple(place for place in places if place == hidden.joint)
            least = min([none, *(self._fitted(name, law, place) for place in places)])
            found.append(Rival(known, math.sqrt(max(0.0, least - own))))
        return found

    def _fitted(self, name: str, law: int, joint: int | None) -> float:
        """Returns the least χ² of the healthy arm with an effect in one of its laws."""
        draw = generator(self.rig.kind_name, self.rig.seed, f"rival {name} {joint}")
        _, size = drawn(self.sound, self.motion, name, joint, draw)
        if joint is not None and self.rig.hidden[0].name == name:
            size = {field: self.rig.hidden[0].sizes.get(field, value) for field, value in size.items()}
        free = tuple(field for field in size if field not in KEPT and not (field == "rate" and "gap" in size))

        def rival(factors: Floats) -> Rig:
            changed = dict(size)
            for field, factor in zip(free, factors.tolist(), strict=True):
                changed[field] = size[field] + MOVED * (factor - 1) if field in SHIFTED else size[field] * factor
            return hide(self.sound, name, joint, law, changed)

        return self._least(rival, len(free), free)

    def _least(self, rival: Callable[[Floats], Rig], count: int, free: tuple[str, ...]) -> float:
        """Returns the least χ² over sizes and tolerances."""

        def left(factors: Floats) -> Floats:
            try:
                made = rival(factors)
                return self._less_tolerances(self._readings(made.bodies, made.joints, made.loop) - self.true)
            except (ValueError, ArithmeticError):
                return np.full(self.true.size + self.answers.shape[1], 1e3)

        best, low = np.ones(0), np.array([-LARGEST if f in SIGNED or f in SHIFTED else 1e-6 for f in free])
        if count:
            either = any(field in SIGNED for field in free)
            starts = [np.array([s, *[1.0] * (count - 1)]) for s in (*STARTS, *([-s for s in STARTS] if either else []))]
            best = min(starts, key=lambda start: _square(left(start)))
            fit = least_squares(
                *(left, best), bounds=(low, [LARGEST] * count), diff_step=1e-2, max_nfev=EVALUATIONS, method="trf"
            )
            best = fit.x
        linear = _square(left(best))
        if linear >= DECIDES**2 or not self.answers.shape[1]:
            return linear
        made = rival(best)
        difference = self._readings(made.bodies, made.joints, made.loop) - self.true
        both = np.concatenate([difference, np.zeros(self.answers.shape[1])])
        steps = -np.linalg.solve(self.triangle, self.basis.T @ both)
        found = self._refitted(rival, best, low, steps)
        return found if math.isfinite(found) else linear

    def _refitted(self, rival: Callable[[Floats], Rig], sizes: Floats, low: Floats, linear: Floats) -> float:
        """Returns χ² with sizes and tolerances refitted by least squares from three starts.

        They are the linear estimate of the tolerances, the true arm's own parameters, and the stated ones. The search
        ends once the record does not distinguish.
        """
        best, made = math.inf, rival(sizes)
        carried = np.array([self._as_true(made, tolerance) for tolerance in self.rig.tolerances])
        bounds = (np.concatenate([low, self.least]), np.concatenate([np.full(low.size, LARGEST), self.most]))
        for start in (carried, np.clip(linear, -FARTHEST, FARTHEST), np.zeros(linear.size)):
            best = min(best, self._searched(rival, sizes, start, bounds))
            if best < NOT_TOLD**2:
                break
        return best

    def _step(self, slopes: Floats, difference: Floats, at: Floats, bounds: tuple[Floats, Floats]) -> Floats:
        """Returns the Gauss–Newton step in sizes and tolerances, within their bounds."""
        tolerances = at[at.size - self.shares.size :]
        off = np.zeros((tolerances.size, at.size))
        off[:, at.size - tolerances.size :] = np.diag(self._off_slopes(tolerances))
        sides = -np.concatenate([difference, self._off(tolerances)])
        rows: Floats = np.asarray(np.linalg.qr(np.column_stack([np.vstack([slopes, off]), sides]), mode="r"))
        room = (bounds[0] - at - 1e-9, bounds[1] - at + 1e-9)
        step = lsq_linear(rows[:, :-1], rows[:, -1], bounds=room, method="bvls").x
        return np.asarray(np.clip(at + step, *bounds) - at)

    def _as_true(self, made: Rig, tolerance: Tolerance) -> float:
        """Returns the deviations by which a parameter of the rival is moved to equal that of the true arm with its
        effect."""
        field, j = ("torque_constant" if tolerance.name == "magnet" else tolerance.name), tolerance.joint
        if j is None:
            return 0.0
        if field in ("mass", "centre", "inertia"):
            true, own = (_of_link(rig.bodies.links[j], field) for rig in (self.rig, made))
        else:
            true, own = (float(rig.joints[field][j]) for rig in (self.rig, made))
        return (true / own - 1.0) / tolerance.share if own else 0.0

    def _off(self, steps: Floats) -> Floats:
        """Returns by how many deviations each value of the file is wrong, if the arm's parameters are `steps`
        deviations from the true arm's.

        It is computed from the ratio of both. As a difference, friction with a stated 30 % would never be more than 3.3
        deviations off, however large it is.
        """
        return np.asarray(np.log(self.factors / (1.0 + self.shares * steps)) / self.shares)

    def _off_slopes(self, steps: Floats) -> Floats:
        """Returns derivatives of these by the steps."""
        return np.asarray(-1.0 / (1.0 + self.shares * steps))

    def _searched(
        self, rival: Callable[[Floats], Rig], sizes: Floats, start: Floats, bounds: tuple[Floats, Floats]
    ) -> float:
        """Returns the least χ² of a search from these sizes (shares of the drawn ones) and `start` (deviations of the
        tolerances).

        Gauss–Newton steps use the derivatives at the true arm, corrected by the result of each step (Broyden 1965), and
        recomputed when they make no more progress. A step thus costs one simulation, not one per parameter.
        """
        own = sizes.size

        def readings_of(x: Floats) -> Floats:
            by = {t: float(s) * t.share for t, s in zip(self.rig.tolerances, x[own:], strict=True)}
            try:
                return self._readings(*moved(rival(x[:own]), by)) - self.true
            except (ValueError, ArithmeticError):  # the rival's arm is impossible
                return np.full(self.true.size, 1e3)

        def cost(x: Floats, difference: Floats) -> float:
            return max(0.0, _square(difference) + _square(self._off(x[own:])) - self.own_cost)

        at = np.clip(np.concatenate([sizes, start]), *bounds)
        difference, formed = readings_of(at), 0
        of_sizes = [(readings_of(at + DIFFERENCE * one) - difference) / DIFFERENCE for one in np.eye(at.size)[:own]]
        slopes = np.column_stack([*of_sizes, self.answers])
        for _ in range(REFITTED):
            step = self._step(slopes, difference, at, bounds)
            after, now = readings_of(at + step), cost(at, difference)
            fell = cost(at + step, after) < (1.0 - LEAST_FALL) * now
            if step.any():
                slopes = slopes + np.outer(after - difference - slopes @ step, step) / _square(step)
            if cost(at + step, after) < now:
                at, difference = at + step, after
            if cost(at, difference) < NOT_TOLD**2:
                break
            if not fell:
                if formed == DERIVATIVES:
                    break
                slopes, formed = _slopes(readings_of, at, difference), formed + 1
        return cost(at, difference)

    def _less_tolerances(self, difference: Floats) -> Floats:
        """Returns the part of a difference that the tolerances cannot remove, with their cost."""
        both = np.concatenate([difference, np.zeros(self.answers.shape[1])])
        return np.asarray(both - self.basis @ (self.basis.T @ both))

    def _readings(self, bodies: Bodies, joints: Records, loop: Records) -> Floats:
        """Returns all readings of the smooth loop, over their noise."""
        motion = without_settling(self.rig, simulate(bodies, joints, _loop(loop), self.asked))
        readings = np.nan_to_num(motion.position, nan=1e3, posinf=1e3, neginf=-1e3)
        return np.asarray((np.clip(readings, -1e3, 1e3) / self.sigma).ravel())


def moved(rig: Rig, by: dict[Tolerance, float]) -> tuple[Bodies, Records, Records]:
    """Returns the rig with values of its tolerances changed by shares of themselves."""
    bodies, joints, loop = rig.bodies, rig.joints.copy(), rig.loop.copy()
    links = list(bodies.links)
    for tolerance, share in by.items():
        factor, j = 1.0 + share, tolerance.joint
        if j is None:
            loop[tolerance.name] *= factor
        elif tolerance.name == "magnet":
            joints["torque_constant"][j] *= factor
            joints["back_emf"][j] *= factor
        elif tolerance.name == "mass":
            about = links[j].inertia
            links[j] = links[j].heavier(links[j].mass * factor)
            links[j] = replace(links[j], inertia=about) if rig.kind.body else links[j]
        elif tolerance.name == "centre":
            links[j] = links[j].shifted(links[j].centre[0] * share)
        elif tolerance.name == "inertia":
            x, y, z = links[j].inertia
            links[j] = replace(links[j], inertia=(x * factor, y * factor, z * factor))
        else:
            joints[tolerance.name][j] *= factor
    return replace(bodies, links=tuple(links)), joints, loop


def _of_link(link: Link, field: str) -> float:
    """Returns a parameter of a link that a tolerance changes."""
    return {"mass": link.mass, "centre": link.centre[0], "inertia": link.inertia[2]}[field]


def _noise(rig: Rig) -> Floats:
    """Returns noise of a reading (rad, by joint): white, of rounding, and coloured at its density at low
    frequencies."""
    pole = math.exp(-2 * math.pi * COLOURED_CORNER * float(rig.loop["period"][0]))
    slow = rig.kind.coloured**2 * (1 + pole) / (1 - pole)
    return np.asarray(rig.joints["count"] * math.sqrt(rig.kind.noise**2 + 1 / 12 + slow))


def _loop(loop: Records) -> Records:
    coarse = loop.copy()
    coarse["step"] = step_within(float(loop["period"][0]), STEP)
    return coarse


def _slopes(left: Callable[[Floats], Floats], at: Floats, residual: Floats) -> Floats:
    """Returns derivatives (m, n) of a residual (m,) at `at` (n,), by differences."""
    return np.column_stack([(left(at + DIFFERENCE * one) - residual) / DIFFERENCE for one in np.eye(at.size)])


def _square(values: Floats) -> float:
    return float(values @ values)
