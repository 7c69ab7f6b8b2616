"""Coordinates in which every point is a physically consistent body: log-Cholesky parameters of its inertia.

There are as many coordinates as unknowns, each in the place of an unknown: α for a mass, d1, d2, d3 for the moments xx,
yy, zz, and s12, s13, s23 for xy, xz, yz. A centre of mass is the coordinate t itself. The change of coordinates is
smooth and invertible, so both give the same covariance: D (Dᵀ A D)⁻¹ Dᵀ = A⁻¹ for an information A about the unknowns
and the derivatives D of the unknowns by the coordinates. Fits therefore compute it from the unknowns, as without this
option.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.machine import Body
from model import layout as at
from model.arrays import Floats
from model.fitting.options import FitOptions
from model.fitting.unknowns import Coordinates, Scaled, Unknown
from model.machine_model.model import Model

COLUMNS = (at.MASS, *range(at.CENTRE_X, at.CENTRE_Z + 1), *range(at.INERTIA_XX, at.INERTIA_YZ + 1))
"""Columns of a body's ten inertial parameters."""
PARTS = ("mass", "centre_x", "centre_y", "centre_z", *(f"inertia_{e}" for e in ("xx", "yy", "zz", "xy", "xz", "yz")))
MASS, MOMENTS, PRODUCTS = 0, slice(4, 10), slice(7, 10)
"""Positions among the ten."""
THINNEST = 1e-3
"""Least e^d, as a share of the stated body's root mean square radius. No body becomes thinner, unless the stated one
is. The bound keeps a fit off the limit of physical consistency.
"""
WIDEST = 1e3
"""Largest e^d, as a multiple of that radius."""
LIGHTEST = 1e-4
"""Least mass, as a share of the stated one, and the inverse of the largest. Users may state narrower bounds. Where the
data do not determine a mass, a search may go anywhere.
"""
LONGEST_STEP = 1.0
"""Largest change of a logarithm in one step: farther away the derivatives at its beginning are useless."""
LEAST_SHARE = 1e-12
"""Least second moment, as a share of their sum, from which log-Cholesky parameters are computed."""
FLAT = 1e-4
"""Share of the second moments of a body below which the smallest is reported: a thickness of a hundredth of its size.
"""
EDGE = 1e-9
"""Share of the sum of second moments by which the smallest may be below 0, because a file's values are rounded."""
INSIDE = 1e-6
"""Share of that sum that the smallest second moment gets at the start: a plate without thickness lies on the limit."""


@dataclass(frozen=True)
class _Body:
    """A body with fitted parameters. numbers: (10,) at the start; places: index of the unknown of each, −1 for none."""

    name: str
    numbers: Floats
    places: tuple[int, ...]

    @property
    def has_fitted_moments(self) -> bool:
        return any(place >= 0 for place in self.places[MOMENTS])

    @property
    def held_products(self) -> NDArray[np.bool_]:
        return np.array([place < 0 for place in self.places[PRODUCTS]])

    def with_values(self, values: Floats) -> Floats:
        """Returns the ten parameters (10,) with values of the unknowns."""
        return np.array([n if p < 0 else values[p] for n, p in zip(self.numbers, self.places, strict=True)])

    @property
    def free(self) -> list[tuple[int, int]]:
        """Returns (index among the seven (α, d, s), index of the unknown) of all coordinates."""
        seven = (self.places[MASS], *self.places[MOMENTS])
        if not self.has_fitted_moments:
            seven = seven[:1]
        return [(k, place) for k, place in enumerate(seven) if place >= 0]


@dataclass(frozen=True)
class _Start:
    """Start of the search for a body: its moments (6,), and α, d, s (7,)."""

    moments: Floats
    seven: Floats


class ConsistentBodies(Scaled):
    """Coordinates of unknowns that keep every body with fitted parameters physically consistent.

    All other unknowns are only scaled. If moments of a body are fitted, xx, yy and zz must all be unknown. Mass, centre
    and products may each be unknown or held; held ones keep their values exactly.

    Raises SpecError if the stated body is not physically consistent, if only some of xx, yy and zz are unknown, if
    moments have bounds, or if an unknown sets parameters of several bodies.
    """

    def __init__(self, model: Model, unknowns: tuple[Unknown, ...]) -> None:
        super().__init__(unknowns)
        self.unknowns = unknowns
        self.bodies = tuple(_bodies(model, unknowns))
        self._starts = [self._start(body) for body in self.bodies]
        for body, start in zip(self.bodies, self._starts, strict=True):
            self._bound(body, start)

    def of_values(self, values: Floats) -> Floats:
        """Returns coordinates (p,); for an inconsistent body, those of the last consistent one on the way from the
        start.
        """
        x = super().of_values(values)
        for body, start in zip(self.bodies, self._starts, strict=True):
            wanted, share = body.with_values(values), 1.0
            begun = body.numbers.copy()
            begun[MOMENTS] = start.moments
            while True:
                between = begun + share * (wanted - begun)
                found = _seven(between, body) if _is_inside(between, body) else None
                if found is not None:
                    break
                share = 0.5 * share if share > 1e-6 else 0.0
            for number, place in body.free:
                x[place] = (found[number] - start.seven[number]) / self.scale[place]
        return x

    def values(self, x: Floats) -> Floats:
        """Returns values (p,) of the unknowns at coordinates (p,)."""
        found = super().values(x)
        for body, start in zip(self.bodies, self._starts, strict=True):
            seven = self._seven_at(body, start, x)
            if body.places[MASS] >= 0:
                mass = self.unknowns[body.places[MASS]]
                found[body.places[MASS]] = np.clip(np.exp(2 * seven[0]), mass.low, mass.high)  # only against rounding
            if body.has_fitted_moments:
                moments, _ = body_of(seven, body.held_products, body.numbers[MOMENTS])
                for moment, place in zip(moments, body.places[MOMENTS], strict=True):
                    if place >= 0:
                        found[place] = moment
        return found

    def chain(self, x: Floats, jacobian: Floats) -> Floats:
        """Converts derivatives (k, p) by the unknowns to derivatives (k, p) by the coordinates at x."""
        return np.asarray(jacobian @ self.derivatives(x))

    def derivatives(self, x: Floats) -> Floats:
        """Returns D (p, p): derivatives of the unknowns (rows) by the coordinates at x (p,)."""
        found = np.diag(self.scale)
        for body, start in zip(self.bodies, self._starts, strict=True):
            seven = self._seven_at(body, start, x)
            for _, place in body.free:
                found[place, place] = 0.0
            if body.places[MASS] >= 0:
                mass = body.places[MASS]
                found[mass, mass] = 2 * np.exp(2 * seven[0]) * self.scale[mass]
            if body.has_fitted_moments:
                _, slopes = body_of(seven, body.held_products, body.numbers[MOMENTS])
                for moment, row in enumerate(body.places[MOMENTS]):
                    if row >= 0:
                        for number, place in body.free:
                            found[row, place] = slopes[moment, number] * self.scale[place]
        return found

    def information_of_values(self, x: Floats, information: Floats) -> Floats:
        """Converts information (p, p) about the coordinates at x to information about the unknowns."""
        derivatives = self.derivatives(x)
        half = np.linalg.solve(derivatives.T, information)
        return np.asarray(np.linalg.solve(derivatives.T, half.T))

    def _seven_at(self, body: _Body, start: _Start, x: Floats) -> Floats:
        seven = start.seven.copy()
        for number, place in body.free:
            seven[number] += self.scale[place] * x[place]
        return seven

    @staticmethod
    def _start(body: _Body) -> _Start:
        """Returns the start of the search: the stated body, moved inside where it lies on the limit."""
        moments = body.numbers[MOMENTS].copy()
        if body.has_fitted_moments:
            second = second_moments(moments)
            missing = INSIDE * float(np.trace(second)) - float(np.linalg.eigvalsh(second)[0])
            if missing > 0.0:
                moments += moments_of(missing * np.eye(3))
        numbers = body.numbers.copy()
        numbers[MOMENTS] = moments
        seven = _seven(numbers, body)
        return _Start(moments, seven)

    def _bound(self, body: _Body, start: _Start) -> None:
        """Sets sizes, bounds and reach of a body's coordinates."""
        radius = np.sqrt(np.trace(second_moments(start.moments)) / np.exp(2 * start.seven[0]))
        for number, place in body.free:
            begun, low, high = start.seven[number], -np.inf, np.inf
            self.scale[place] = 1.0
            self.reach[place] = LONGEST_STEP
            if number == 0:
                given = self.unknowns[place]
                low, high = begun + 0.5 * np.log(LIGHTEST), begun - 0.5 * np.log(LIGHTEST)
                low = max(low, 0.5 * np.log(given.low)) if given.low > 0.0 else low
                high = min(high, 0.5 * np.log(given.high)) if np.isfinite(given.high) else high
            elif number <= 3:
                low, high = min(np.log(THINNEST * radius), begun - 1.0), np.log(WIDEST * radius)
            else:
                self.scale[place], self.reach[place] = radius, np.inf
            self.low[place] = (low - begun) / self.scale[place]
            self.high[place] = (high - begun) / self.scale[place]


def _bodies(model: Model, unknowns: Sequence[Unknown]) -> list[_Body]:
    """Returns the bodies with unknown parameters. Raises SpecError as `ConsistentBodies` does."""
    places = {slot: k for k, u in enumerate(unknowns) for slot in u.parameter.slots}
    found = []
    for number in model.machine.modelled_joints:
        if not isinstance(model.machine.joint(number).link, Body):
            continue
        slots = [at.slot(number, column) for column in COLUMNS]
        own = tuple(places.get(slot, -1) for slot in slots)
        if all(place < 0 for place in own):
            continue
        for place in own:
            if place >= 0 and len(unknowns[place].parameter.slots) > 1:
                raise SpecError(
                    f"{unknowns[place].name}: sets several parameters at once; with consistent inertias each parameter "
                    "of a body is fitted separately: remove the tie from the model, or hold it"
                )
        numbers = np.array([model.vector[s] if p < 0 else unknowns[p].start for s, p in zip(slots, own, strict=True)])
        body = _Body(f"link{number}", numbers, own)
        _check_stated(body)
        _check_choice(body, unknowns)
        found.append(body)
    return found


def _check_choice(body: _Body, unknowns: Sequence[Unknown]) -> None:
    if not body.has_fitted_moments:
        return
    names = [f"{body.name}.{part}" for part in PARTS]
    if held := [names[k] for k in range(4, 7) if body.places[k] < 0]:
        fitted = [names[k] for k in range(4, 10) if body.places[k] >= 0]
        raise SpecError(
            f"{', '.join(fitted)}: with consistent inertias xx, yy and zz of a body are fitted together: fit "
            f"{' and '.join(held)} as well, or hold {body.name}.inertia_*"
        )
    for number, place in enumerate(body.places[MOMENTS]):
        u = unknowns[place]
        if place >= 0 and (u.low, u.high) != (0.0 if number < 3 else -np.inf, np.inf):
            raise SpecError(
                f"{u.name}: bounds {u.low:g} to {u.high:g} {u.unit}: with consistent inertias a moment cannot have "
                "bounds; remove them, or state an expected deviation"
            )


def _check_stated(body: _Body) -> None:
    mass, moments = float(body.numbers[MASS]), body.numbers[MOMENTS]
    second = second_moments(moments)
    least, whole = float(np.linalg.eigvalsh(second)[0]), float(np.trace(second))
    principal = ", ".join(f"{m:.4g}" for m in sorted(whole - np.linalg.eigvalsh(second)))
    stated = f"{body.name}: {mass:.4g} kg with the principal moments {principal} kg·m²"
    if mass < 0.0 or least < -EDGE * abs(whole):
        raise SpecError(
            f"{stated} is not physically consistent (mass above 0, no moment above the sum of the others); consistent "
            "inertias must start from a consistent body"
        )
    if mass == 0.0 or (whole == 0.0 and body.has_fitted_moments):
        raise SpecError(
            f"{stated}: consistent inertias start from a mass and moments above 0; state them, or hold the body"
        )


def _is_inside(numbers: Floats, body: _Body) -> bool:
    if not numbers[MASS] > 0.0:
        return False
    if not body.has_fitted_moments:
        return True
    second = np.linalg.eigvalsh(second_moments(numbers[MOMENTS]))
    return bool(second[0] > LEAST_SHARE * second.sum())


def _seven(numbers: Floats, body: _Body) -> Floats:
    """Returns α, d, s (7,) of ten parameters; only α where no moment is fitted."""
    if body.has_fitted_moments:
        return log_cholesky(float(numbers[MASS]), numbers[MOMENTS])
    return np.array([0.5 * np.log(numbers[MASS]), *np.zeros(6)])


def on_the_edge(before: Model, fitted: Model, options: FitOptions) -> tuple[str, ...]:
    """Returns links whose fitted body is flat or thin although the stated one is not: the records suggest an
    inconsistent one.

    Empty without consistent inertias.
    """
    if not options.consistent_inertias:
        return ()
    found = []
    for number in fitted.machine.modelled_joints:
        if isinstance(fitted.machine.joint(number).link, Body):
            slots = [at.slot(number, column) for column in COLUMNS[MOMENTS]]
            least = [np.linalg.eigvalsh(second_moments(model.vector[slots])) for model in (before, fitted)]
            stated, now = (float(s[0] / s.sum()) if s.sum() > 0.0 else 0.0 for s in least)
            if now < FLAT and now < 0.1 * stated:
                found.append(f"link{number}")
    return tuple(found)


def coordinates_of(model: Model, unknowns: tuple[Unknown, ...], options: FitOptions) -> Coordinates | None:
    """Returns the coordinates that the options select; None: the unknowns themselves.

    Raises SpecError as `ConsistentBodies` does, and for a method without a choice of coordinates.
    """
    if not options.consistent_inertias:
        return None
    if options.method != "least_squares":
        raise SpecError(
            f"consistent_inertias: cannot be used with the method {options.method}, only with least_squares"
        )
    return ConsistentBodies(model, unknowns)


# --- Log-Cholesky parameters of a rigid body's inertia
#
# Rucker and Wensing, "Smooth parameterization of rigid-body inertia", IEEE Robotics and Automation Letters 7 (2022):
# the pseudo-inertia J (4, 4) is U Uᵀ with U = e^α [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0,
# 0, 1]]. Every choice of the ten parameters is a physically consistent body, and every such body has exactly one
# choice. Consistent means that J is positive definite: mass above 0, and principal moments that satisfy the triangle
# inequality strictly (Wensing, Kim and Slotine, same journal 3, 2018).
#
# The last column of U gives the mass e^2α and the centre of mass t. With the centre known, the rest of U is a factor of
# the second moments about it, Σ = ½ tr(I) 1 − I. The six moments I thus depend on α, d and s alone.


ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
"""Positions of xx, yy, zz, xy, xz and yz in a matrix."""


def matrix_of(moments: Floats) -> Floats:
    """Returns the symmetric matrix (3, 3) of xx, yy, zz, xy, xz, yz (6,)."""
    matrix = np.zeros((3, 3))
    for value, (row, column) in zip(moments, ENTRIES, strict=True):
        matrix[row, column] = matrix[column, row] = value
    return matrix


def second_moments(moments: Floats) -> Floats:
    """Returns Σ (3, 3) = ∫ r rᵀ dm, kg·m², of the moments of inertia (6,) about the same point."""
    inertia = matrix_of(moments)
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def moments_of(second: Floats) -> Floats:
    """Returns moments of inertia (6,), kg·m², of second moments (3, 3); linear, so it also converts their changes."""
    inertia = np.trace(second) * np.eye(3) - second
    return np.array([inertia[place] for place in ENTRIES])


def log_cholesky(mass: float, moments: Floats) -> Floats:
    """Returns α, d1, d2, d3, s12, s13, s23 (7,) of a body; its centre is t. Raises LinAlgError for no real body."""
    if not mass > 0.0:
        raise np.linalg.LinAlgError("no mass")
    second = second_moments(moments) / mass
    upper = np.linalg.cholesky(second[::-1, ::-1])[::-1, ::-1]
    return np.array([0.5 * np.log(mass), *np.log(np.diag(upper)), upper[0, 1], upper[0, 2], upper[1, 2]])


def body_of(parameters: Floats, held: NDArray[np.bool_], moments: Floats) -> tuple[Floats, Floats]:
    """Returns moments (6,) of a body, kg·m², and their derivatives (6, 7) by α, d1, d2, d3, s12, s13, s23.

    A product of inertia may be held. Its s then follows from the parameters that precede it in U and is no free
    parameter. Every choice of the others is still a consistent body with exactly that product.

    Args:
        parameters: (7,); s of held products is ignored. held: (3,) which of xy, xz, yz are held.
        moments: (6,) of the body; only held ones are used.
    """
    scale, (d1, d2, d3) = np.exp(parameters[0]), np.exp(parameters[1:4])
    unit = np.eye(7)
    # every entry of U without its last row and column, and its derivatives (7,)
    zz = scale * d3
    zz_by = zz * (unit[0] + unit[3])
    yy = scale * d2
    yy_by = yy * (unit[0] + unit[2])
    xx = scale * d1
    xx_by = xx * (unit[0] + unit[1])

    def free(number: int) -> tuple[float, Floats]:
        value = scale * parameters[number]
        return value, value * unit[0] + scale * unit[number]

    def quotient(above: float, above_by: Floats, below: float, below_by: Floats) -> tuple[float, Floats]:
        return above / below, (above_by - above / below * below_by) / below

    nothing = np.zeros(7)
    yz, yz_by = quotient(-moments[5], nothing, zz, zz_by) if held[2] else free(6)
    xz, xz_by = quotient(-moments[4], nothing, zz, zz_by) if held[1] else free(5)
    if held[0]:
        xy, xy_by = quotient(-moments[3] - xz * yz, -xz_by * yz - xz * yz_by, yy, yy_by)
    else:
        xy, xy_by = free(4)
    factor = np.array([[xx, xy, xz], [0.0, yy, yz], [0.0, 0.0, zz]])
    slopes = np.zeros((7, 3, 3))
    for (row, column), by in zip(
        ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), (xx_by, xy_by, xz_by, yy_by, yz_by, zz_by), strict=True
    ):
        slopes[:, row, column] = by
    found = moments_of(factor @ factor.T)
    found[3:][held] = moments[3:][held]  # exact to the last digit
    return found, np.array([moments_of(slope @ factor.T + factor @ slope.T) for slope in slopes]).T
