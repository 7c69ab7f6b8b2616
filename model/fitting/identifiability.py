"""Reports identifiability: a verdict on every parameter, and the combinations that the data cannot determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.frozen import FrozenRecord
from daq.contracts.service.jobs import ParameterWords
from model.arrays import Floats
from model.fitting.covariance import inverse
from model.fitting.unknowns import Unknown

Verdict = Literal["known", "combination", "unknown"]

KNOWN_SHARE = 0.5
"""Largest deviation from the data alone, as a share of the natural size, of a parameter that counts as known."""
LARGEST_DEVIATION = 30.0
"""Largest deviation that is reported, in natural sizes: farther away the model is not linear."""
STRONG_CORRELATION = 0.95
"""Correlation of estimates above which parameters form a group."""
WEAKEST_PRIOR = 1e3
"""Deviation of a very wide prior, in natural sizes: it keeps the arithmetic finite where the data have no information.
"""


class ParameterVerdict(FrozenRecord):
    """Verdict on one parameter.

    `data_deviation` follows from the data alone, with all other parameters free; `alone`, if all others were known
    exactly. Both are in the parameter's unit; None if the data do not depend on it. `expected_deviation` is the
    prior's.
    """

    name: str
    unit: str
    verdict: Verdict
    reason: str
    data_deviation: float | None
    alone: float | None
    expected_deviation: float | None


class Member(FrozenRecord):
    """A parameter's part in a combination: its change as a share of its value (if that is zero, in its unit)."""

    name: str
    change: float
    relative: bool


class Combination(FrozenRecord):
    """A combination of changes that leaves the records unchanged, within the noise."""

    text: str
    members: tuple[Member, ...]
    torque_scale: bool
    deviation: float | None
    """Its deviation from the data alone, in natural sizes of its largest member; None if the data do not depend on it.
    """


class IdentifiabilityReport(FrozenRecord):
    """The parameters and combinations that the data of a fit determine, and those that they do not."""

    parameters: tuple[ParameterVerdict, ...]
    undetermined: tuple[Combination, ...]
    correlated: tuple[tuple[str, ...], ...]
    """Groups of parameters whose estimates are correlated above 0.95 (data and priors together)."""
    torque_scale_free: bool

    def verdict(self, name: str) -> ParameterVerdict:
        """Returns the verdict on one parameter. Raises KeyError if it was not among the unknowns."""
        return {p.name: p for p in self.parameters}[name]

    @property
    def known(self) -> tuple[str, ...]:
        """Names of the parameters that the data determine."""
        return tuple(p.name for p in self.parameters if p.verdict == "known")


def judged(jacobian: Floats, values: Floats, unknowns: Sequence[Unknown]) -> IdentifiabilityReport:
    """Returns the report for a whitened Jacobian (m, p) of the data alone at `values` (p,).

    Nuisances enter with their priors, which describe sensor and start; they get no verdict. Other priors do not enter
    the verdicts, because an expected value is not a known one.
    """
    natural = np.array([u.scale for u in unknowns])
    nuisance = np.array([u.nuisance for u in unknowns])
    claimed = np.array([u.nuisance and u.deviation is not None for u in unknowns])
    scaled = jacobian * natural
    information = scaled.T @ scaled + np.diag(np.where(claimed, 1.0, WEAKEST_PRIOR**-2))
    marginal = np.sqrt(np.diag(inverse(information)))
    alone = np.linalg.norm(scaled, axis=0)
    reduced, kept = _without_nuisances(scaled, nuisance, claimed), np.flatnonzero(~nuisance).tolist()
    own = [unknowns[k] for k in kept]
    directions = undetermined(reduced / natural[kept], values[kept], natural[kept], [u.torque for u in own])
    combinations = tuple(_combination(d, own, values[kept]) for d in directions)
    verdicts = tuple(_verdict(unknowns[k], marginal[k], alone[k], combinations) for k in kept)
    prior = np.array([1.0 if u.deviation is not None else WEAKEST_PRIOR**-2 for u in unknowns])
    both = inverse(scaled.T @ scaled + np.diag(prior))
    return IdentifiabilityReport(
        parameters=verdicts,
        undetermined=combinations,
        torque_scale_free=any(d.torque_scale for d in directions),
        correlated=_groups(both[np.ix_(kept, kept)], [u.name for u in own]),
    )


def _without_nuisances(scaled: Floats, nuisance: NDArray[np.bool_], claimed: NDArray[np.bool_]) -> Floats:
    """Returns a square root of the information about the other parameters; nuisances (with priors) are marginalised."""
    other = scaled[:, ~nuisance]
    information = other.T @ other
    if nuisance.any():
        n = scaled[:, nuisance]
        inner = n.T @ n + np.diag(np.where(claimed[nuisance], 1.0, WEAKEST_PRIOR**-2))
        cross = n.T @ other
        information = information - cross.T @ np.linalg.solve(inner, cross)
    eigenvalues, vectors = np.linalg.eigh(0.5 * (information + information.T))
    return np.asarray(np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T)


def _verdict(
    unknown: Unknown, marginal: float, sensitivity: float, combinations: Sequence[Combination]
) -> ParameterVerdict:
    alone = 1.0 / sensitivity if sensitivity > 1.0 / WEAKEST_PRIOR else None
    size = "expected deviation" if unknown.deviation is not None else "value"
    inside = [c for c in combinations if any(m.name == unknown.name for m in c.members)]
    verdict: Verdict
    if marginal <= KNOWN_SHARE:
        verdict, reason = "known", f"the data alone determine it to {marginal:.2g} of its {size}"
    elif alone is not None and alone <= KNOWN_SHARE:
        verdict = "combination"
        reason = f"alone it would be known to {alone:.2g} of its {size}, but others can compensate for it" + (
            f": {inside[0].text}" if inside else ""
        )
    else:
        verdict = "unknown"
        reason = f"its {size} changes these records by {sensitivity:.2g} standard deviations of the noise"
        if alone is None:
            reason = "it does not change these records at all"
    return ParameterVerdict(
        name=unknown.name,
        unit=unknown.unit,
        verdict=verdict,
        reason=reason,
        data_deviation=marginal * unknown.scale if marginal < LARGEST_DEVIATION else None,
        alone=None if alone is None else alone * unknown.scale,
        expected_deviation=unknown.deviation,
    )


def _combination(direction: Direction, unknowns: Sequence[Unknown], values: Floats) -> Combination:
    members = []
    for share, unknown, value in zip(direction.members, unknowns, values, strict=True):
        if direction.torque_scale:
            if unknown.torque and value != 0.0:
                members.append(Member(name=unknown.name, change=float(unknown.torque), relative=True))
        elif abs(share) >= NEGLIGIBLE:
            change, relative = share * unknown.scale, value != 0.0
            members.append(Member(name=unknown.name, change=change / value if relative else change, relative=relative))
    members = _smallest_readable(members)
    return Combination(
        text=_text(members, direction.torque_scale, {u.name: u.unit for u in unknowns}),
        members=tuple(members),
        torque_scale=direction.torque_scale,
        deviation=direction.deviation if np.isfinite(direction.deviation) else None,
    )


def _smallest_readable(members: list[Member]) -> list[Member]:
    """Returns members scaled so that the largest relative change is 1 (100 %)."""
    largest = max((abs(m.change) for m in members if m.relative), default=0.0)
    if largest == 0.0:
        return members
    return [m.model_copy(update={"change": m.change / largest}) for m in members]


def undetermined_in_words(report: IdentifiabilityReport, words: Mapping[str, ParameterWords]) -> tuple[str, ...]:
    """Returns the text of each undetermined combination, with parameters in words."""
    units = {p.name: p.unit for p in report.parameters}
    labels = {name: own.label for name, own in words.items()}
    return tuple(_text(one.members, one.torque_scale, units, labels) for one in report.undetermined)


def _text(
    members: Sequence[Member], torque_scale: bool, units: Mapping[str, str], labels: Mapping[str, str] | None = None
) -> str:
    called = [(labels or {}).get(m.name, m.name) for m in members]
    if torque_scale:
        return f"the scale of torque: {', '.join(called)} may all be larger or smaller by the same factor"
    if len(members) == 1:
        return f"{called[0]} alone"
    return "together " + ", ".join(f"{name} {_change(m, units)}" for name, m in zip(called, members, strict=True))


def _change(member: Member, units: Mapping[str, str]) -> str:
    size, unit = (member.change, "%") if member.relative else (0.01 * member.change, units[member.name])
    return f"{size:+.2g} {unit}".replace("-", "−")


def _groups(covariance: Floats, names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    deviations = np.sqrt(np.diag(covariance))
    linked = np.abs(covariance / np.outer(deviations, deviations)) > STRONG_CORRELATION
    left, groups = set(range(len(names))), []
    while left:
        group, edge = set(), {left.pop()}
        while edge:
            k = edge.pop()
            group.add(k)
            edge |= {int(j) for j in np.flatnonzero(linked[k])} - group
        left -= group
        if len(group) > 1:
            groups.append(tuple(names[k] for k in sorted(group)))
    return tuple(sorted(groups))


# --- Finds directions in parameter space along which the data do not change, and names them as combinations
#
# In scaled coordinates one unit is the expected deviation, else the value. Each direction has a singular value of the
# whitened Jacobian; its inverse is the deviation that the data alone give that direction. Above one, the data give less
# than was expected beforehand. These directions span a space, and a basis whose vectors have few members can be put
# into words. One direction has a name: scaling all masses, torque constants, friction and rotor inertias together does
# not change the motion, because positions and voltages do not fix the scale of torque.


UNKNOWN_DEVIATION = 1.0
"""Deviation, in natural sizes, above which the data do not determine a direction."""
NEGLIGIBLE = 0.12
"""Share of a direction's largest member below which a member is left out of its name."""
FREE_SCALE = 0.03
"""Largest change of the whitened residual (all samples together) by the natural size of a direction that counts as
zero.
"""


@dataclass(frozen=True)
class Direction:
    """A combination that the data do not determine.

    Args:
        members: (p,) change of every unknown, in natural sizes, largest member 1.
        deviation: from the data alone, in natural sizes of the largest member; inf if the data do not depend on it.
        torque_scale: whether it is the scale of all torques.
    """

    members: Floats
    deviation: float
    torque_scale: bool = False


def undetermined(jacobian: Floats, values: Floats, natural: Floats, torque: Sequence[int]) -> list[Direction]:
    """Returns the directions that the data do not determine, the torque scale first.

    Args:
        jacobian: (m, p) whitened, per unit of each unknown. values: (p,) at which it was computed.
        natural: (p,) natural sizes. torque: (p,) power with which each unknown scales with torque.
    """
    scaled = jacobian * natural
    _, singular, rows = np.linalg.svd(scaled, full_matrices=True)
    padded = np.concatenate([singular, np.zeros(len(rows) - len(singular))])
    weak = rows[padded < 1.0 / UNKNOWN_DEVIATION]
    if len(weak) == 0:
        return []
    found = []
    scale = torque_scale(values, natural, torque)
    if scale is not None and np.linalg.norm(scaled @ scale) < FREE_SCALE:
        found.append(_direction(scaled, scale, torque_scale=True))
        unit = scale / np.linalg.norm(scale)
        weak = _without(weak, weak @ unit)
    return found + [_direction(scaled, v) for v in sparse_basis(weak)]


def torque_scale(values: Floats, natural: Floats, torque: Sequence[int]) -> Floats | None:
    """Returns the direction that scales all torques, largest member 1; None with fewer than two unknowns that contain
    torque.

    The relative change of each unknown is its power of torque.
    """
    direction = values * np.asarray(torque) / natural
    if np.count_nonzero(direction) < 2:
        return None
    return np.asarray(direction / np.abs(direction).max())


def sparse_basis(rows: Floats) -> list[Floats]:
    """Returns another basis of the span of the orthonormal rows (k, p): each vector has a member that no other has.

    It is the reduced echelon form on the k best-conditioned columns.
    """
    from scipy.linalg import qr  # imported here: the service shows fits without making any

    if len(rows) == 0:
        return []
    pivots = qr(rows, mode="economic", pivoting=True)[2][: len(rows)]
    echelon = np.linalg.solve(rows[:, pivots], rows)
    return [row / np.abs(row).max() * np.sign(row[np.argmax(np.abs(row))]) for row in echelon]


def _without(rows: Floats, coordinates: Floats) -> Floats:
    """Returns an orthonormal basis of the part of the span of `rows` that is orthogonal to `coordinates`."""
    size = np.linalg.norm(coordinates)
    if size < 0.5:
        return rows
    across = np.linalg.svd((coordinates / size)[None, :], full_matrices=True)[2][1:]
    return np.asarray(across @ rows)


def _direction(scaled: Floats, members: Floats, torque_scale: bool = False) -> Direction:
    change = float(np.linalg.norm(scaled @ members))
    return Direction(members, 1.0 / change if change > 1e-9 else float("inf"), torque_scale)
