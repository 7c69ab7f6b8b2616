"""Finds which inertial parameters act on which joint: the source's tables 5.1 to 5.3 beside the dynamics."""

from __future__ import annotations

import numpy as np

from daq.contracts.frozen import FrozenRecord
from model.dynamics.inertial_influence import PARAMETERS, State, acting_parameters, parameter_name
from model.kinematics.chain import Chain


class Influence(FrozenRecord):
    """Parameters that act on one joint's torque, by the dynamics and as published; names such as m3, c2x, I3zz."""

    table: str
    joint: int
    acting: tuple[str, ...]
    published: tuple[str, ...]

    @property
    def published_too_many(self) -> tuple[str, ...]:
        """Parameters that the source names although they have no effect."""
        return tuple(p for p in self.published if p not in self.acting)

    @property
    def published_too_few(self) -> tuple[str, ...]:
        """Parameters that have an effect although the source does not name them."""
        return tuple(p for p in self.acting if p not in self.published)


def influences(
    chain: Chain, table: str, published: tuple[frozenset[str], ...], *, waist_still: bool = False, states: int = 10
) -> tuple[Influence, ...]:
    """Returns parameters of a chain of revolute joints that act at random states, beside published ones, by joint.

    Raises ChainError for a prismatic joint.
    """
    acting = acting_parameters(chain, _states(chain.joint_count, states, waist_still))
    links, kinds = range(1, chain.joint_count + 1), range(len(PARAMETERS))
    order = [parameter_name(link, kind) for link in links for kind in kinds]
    return tuple(
        Influence(table=table, joint=j, acting=tuple(a), published=tuple(p for p in order if p in named))
        for j, (a, named) in enumerate(zip(acting, published, strict=True), start=1)
    )


def _states(joints: int, count: int, waist_still: bool) -> list[State]:
    rng = np.random.default_rng(5)
    still = np.ones(joints)
    if waist_still:
        still[0] = 0.0

    def state() -> State:
        return rng.uniform(-3, 3, joints), still * rng.normal(size=joints), still * rng.normal(size=joints)

    return [state() for _ in range(count)]
