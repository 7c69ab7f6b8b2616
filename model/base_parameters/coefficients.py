"""Expresses the coefficients of combined parameters as products of the arm's lengths: `a_1²`, `−d_3`.

A coefficient is a polynomial in the Denavit–Hartenberg lengths, homogeneous of the power that the units require. Its
factors are found by least squares over arms with the same angles and other lengths, so that two equal lengths are not
confused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from model.arrays import Floats
from model.base_parameters.grouping import Grouping
from model.base_parameters.standard import Motion, Standard, inertial_regressor
from model.kinematics.chain import ChainArrays

EXACT = 1e-6
"""Largest error of a polynomial that counts as none, relative to the largest of its values."""
ROUND = 1e-5
"""Distance within which a factor is a whole number or a half."""
NO_LENGTH = 1e-9
"""Length (m) that counts as zero."""
ENOUGH = 3
"""Rows of a regressor per column at which its dependences are computed again."""
_STRETCH = (0.6, 1.6)


@dataclass(frozen=True)
class Term:
    """A factor times a product of lengths, such as 2 `a_1` `d_2`; no lengths: a plain number."""

    factor: float
    lengths: tuple[str, ...]


def named_shares(
    chain: ChainArrays, motion: Motion, standards: Sequence[Standard], grouping: Grouping, seed: int
) -> dict[tuple[int, int], tuple[Term, ...]]:
    """Returns the terms of every nonzero share, by its row and column in `grouping.shares`.

    A share that is not a polynomial of the lengths stays a number.
    """
    found: dict[tuple[int, int], tuple[Term, ...]] = {
        (int(row), int(column)): (Term(float(grouping.shares[row, column]), ()),)
        for row, column in np.argwhere(grouping.shares != 0.0)
    }
    lengths = _lengths(chain)
    powers = {place: power for place in found if (power := _power(standards, grouping, place)) in (1, 2)}
    if not powers or not lengths:
        return found
    names = [_name(place) for place in lengths]
    products = {
        power: list(combinations_with_replacement(range(len(lengths)), power)) for power in set(powers.values())
    }
    rng = np.random.default_rng(seed)
    stretches = rng.uniform(*_STRETCH, (max(map(len, products.values())) + 4, len(lengths)))
    values = np.array([[chain.geometry[place] for place in lengths]]) * stretches
    few = _first_postures(motion, ENOUGH * len(standards) // len(chain.geometry))
    shares = [_shares(chain, few, grouping, lengths, row) for row in values]
    for place, own_power in powers.items():
        monomials = products[own_power]
        table = np.array([[np.prod([row[k] for k in product]) for product in monomials] for row in values])
        seen = np.array([one[place] for one in shares])
        factors = np.linalg.lstsq(table, seen, rcond=None)[0]
        own = np.array([np.prod([chain.geometry[lengths[k]] for k in product]) for product in monomials])
        off = max(np.abs(table @ factors - seen).max(), abs(own @ factors - grouping.shares[place]))
        if off > EXACT * max(1.0, np.abs(seen).max()):
            continue
        terms = tuple(
            Term(_rounded(factor), tuple(names[k] for k in product))
            for factor, product in zip(factors, monomials, strict=True)
            if abs(factor) > ROUND
        )
        found[place] = terms or found[place]
    return found


def _first_postures(motion: Motion, count: int) -> Motion:
    return Motion(motion.position[:count], motion.speed[:count], motion.acceleration[:count], motion.contact[:count])


def _lengths(chain: ChainArrays) -> list[tuple[int, int]]:
    """Returns places in `geometry` of the nonzero lengths; d of a prismatic joint is its position."""
    return [
        (joint, column)
        for joint in range(len(chain.geometry))
        for column in (1, 2)
        if abs(chain.geometry[joint, column]) > NO_LENGTH and not (column == 1 and chain.prismatic[joint])
    ]


def _name(place: tuple[int, int]) -> str:
    return f"{'d' if place[1] == 1 else 'a'}_{place[0] + 1}"


def _power(standards: Sequence[Standard], grouping: Grouping, place: tuple[int, int]) -> int:
    """Returns the power of length of a share, by the units; 0 for friction."""
    base, other = standards[grouping.base[place[0]]], standards[grouping.regrouped[place[1]]]
    return 0 if base.degree is None or other.degree is None else base.degree - other.degree


def _shares(
    chain: ChainArrays, motion: Motion, grouping: Grouping, lengths: Sequence[tuple[int, int]], values: Floats
) -> Floats:
    """Returns the shares of an arm with other lengths for the same base columns.

    Those of joints' parameters are left out, since none of them depends on a length.
    """
    geometry = chain.geometry.copy()
    for place, value in zip(lengths, values, strict=True):
        geometry[place] = value
    columns = inertial_regressor(chain._replace(geometry=geometry), motion)
    columns = columns.reshape(-1, columns.shape[-1])
    inside = [row for row, index in enumerate(grouping.base) if index < columns.shape[1]]
    taken = [column for column, index in enumerate(grouping.regrouped) if index < columns.shape[1]]
    found = np.zeros_like(grouping.shares)
    own, others = ([seq[k] for k in kept] for seq, kept in ((grouping.base, inside), (grouping.regrouped, taken)))
    sizes = np.linalg.norm(columns[:, own], axis=0)
    solved = np.linalg.lstsq(columns[:, own] / sizes, columns[:, others], rcond=None)[0] / sizes[:, None]
    found[np.ix_(inside, taken)] = solved
    return found


def _rounded(factor: float) -> float:
    near = round(2 * factor) / 2
    return near if near != 0.0 and abs(factor - near) < ROUND else float(factor)
