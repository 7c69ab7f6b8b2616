"""Computes the base parameters of a machine by QR of a regressor at random admissible postures, and which of them
records determine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.base_parameters.coefficients import Term, named_shares
from model.base_parameters.excitation import excitation_of
from model.base_parameters.grouping import Grouping, grouped, preferred_order
from model.base_parameters.result import BaseMember, BaseParameter, BaseParameters, written
from model.base_parameters.standard import (
    Motion,
    Standard,
    inertial_regressor,
    joint_parameters,
    joint_regressor,
    link_parameters,
    standard_values,
)
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.record_check.check import as_used
from model.simulation.chain_of_model import chain_of

POSTURES_PER_PARAMETER = 3
"""Random postures for each standard parameter: each gives as many rows as there are joints."""
SLIDING_RANGE = 1.0
"""Range of positions (m) drawn for a prismatic joint without limits."""
HIGHEST_SPEED = 3.0
"""Largest speed drawn, rad/s (m/s), unless the joint's own limit is lower."""
REVERSAL = 0.2
"""Time (s) in which a drawn acceleration changes the speed by the largest speed."""
LINEAR = (
    "viscous_friction",
    "coulomb_friction",
    "weakened_magnet",
    "payload",
    "link_mass",
    "centre_of_mass",
    "base_tilt",
)
"""Effects that the standard parameters, or gravity's direction, already contain."""


def base_parameters(model: Model, traces: Sequence[Trace] = (), *, seed: int = 0) -> BaseParameters:
    """Returns the base parameters of a model's machine.

    They are the fewest combinations of inertial and friction parameters that determine its joint torques. For traces
    with a recorded drive, the result also states which of them the traces determine. Postures, speeds and accelerations
    are drawn within the machine's limits (Gautier 1991; Khalil and Dombre 2002, chapter 12). The parameters of links
    are about the foot of the common normal on their own joint's axis.

    Args:
        traces: of the model's machine. If they cannot be judged (no drive, too short), `no_excitation` says why.
        seed: of the drawn postures.
    """
    chain = chain_of(model)
    standards = (*link_parameters(model.joint_count), *joint_parameters(model))
    motion = random_motion(model.machine, POSTURES_PER_PARAMETER * len(standards), seed)
    whole = regressor(chain, standards, motion)
    grouping = grouped(whole.reshape(-1, len(standards)), preferred_order(standards, chain.prismatic.tolist()))
    terms = named_shares(chain, motion, standards, grouping, seed)
    values = standard_values(model, standards)
    found = BaseParameters(
        machine=model.machine.title,
        model=model.identity,
        standard=len(standards),
        parameters=_parameters(standards, grouping, terms, values),
        without_effect=tuple(standards[k].symbol for k in grouping.without_effect),
        postures=len(motion.position),
        seed=seed,
        smallest_kept=grouping.gap[0],
        largest_dropped=grouping.gap[1],
        left_out=tuple(sorted({use.name for use in model.effects if use.name not in LINEAR})),
    )
    if not traces:
        return found
    sizes = np.array([parameter.value for parameter in found.parameters])
    try:
        told = excitation_of(model, as_used(traces, model.machine), standards, grouping, sizes)
    except (TraceError, SpecError) as error:
        return found.model_copy(update={"no_excitation": str(error)})
    return found.model_copy(update={"excitation": told})


def regressor(chain: ChainArrays, standards: Sequence[Standard], motion: Motion) -> Floats:
    """Returns columns (k, n, p) of joint torques by standard parameters: all of `link_parameters`, then some of
    joints."""
    links = 10 * len(chain.geometry)
    return np.concatenate((inertial_regressor(chain, motion), joint_regressor(standards[links:], motion)), axis=2)


def random_motion(machine: Machine, count: int, seed: int) -> Motion:
    """Returns postures, speeds and accelerations (count, n) drawn evenly within a machine's limits."""
    rng = np.random.default_rng(seed)
    low, high, speed = [], [], []
    for number in machine.modelled_joints:
        limit = machine.limits.joint(number)
        widest = np.pi if machine.joint(number).kind == "revolute" else 0.5 * SLIDING_RANGE
        least = -widest if limit.low is None else limit.low
        low.append(least)
        high.append(least + 2 * widest if limit.high is None else limit.high)
        speed.append(HIGHEST_SPEED if limit.speed is None else min(HIGHEST_SPEED, limit.speed))
    shape, fast = (count, len(low)), np.array(speed)
    rate = rng.uniform(-fast, fast, shape)
    return Motion(
        rng.uniform(low, high, shape), rate, rng.uniform(-fast / REVERSAL, fast / REVERSAL, shape), np.sign(rate)
    )


def _parameters(
    standards: Sequence[Standard],
    grouping: Grouping,
    terms: dict[tuple[int, int], tuple[Term, ...]],
    values: Floats,
) -> tuple[BaseParameter, ...]:
    found = []
    for row, index in enumerate(grouping.base):
        own = standards[index]
        members = [
            _member(standards[other].symbol, float(grouping.shares[row, column]), terms[row, column])
            for column, other in sorted(enumerate(grouping.regrouped), key=lambda pair: pair[1])
            if grouping.shares[row, column] != 0.0
        ]
        members.sort(key=lambda member: member.written != "1")
        value = values[index] + float(grouping.shares[row] @ values[list(grouping.regrouped)])
        found.append(
            BaseParameter(
                text=written(own.symbol, members),
                unit=own.unit,
                joint=own.joint,
                inertial=own.degree is not None,
                members=(BaseMember(symbol=own.symbol, factor=1.0, written="1"), *members),
                value=value,
            )
        )
    return tuple(found)


def _member(symbol: str, factor: float, terms: Sequence[Term]) -> BaseMember:
    parts = [_term(one) for one in terms]
    text = parts[0]
    if len(parts) > 1:
        text = "(" + parts[0] + "".join(f" − {p[1:]}" if p.startswith("−") else f" + {p}" for p in parts[1:]) + ")"
    return BaseMember(symbol=symbol, factor=factor, written=text)


def _term(term: Term) -> str:
    powers = dict.fromkeys(term.lengths, 0)
    for name in term.lengths:
        powers[name] += 1
    lengths = " ".join(name + ("²" if power == 2 else "") for name, power in powers.items())
    size, sign = abs(term.factor), "−" if term.factor < 0 else ""
    number = "" if size == 1.0 and lengths else f"{size:.6g}"
    return sign + " ".join(part for part in (number, lengths) if part)
