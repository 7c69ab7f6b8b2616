"""Finds which inertial parameters of which link act on which joint (thesis 5.2, tables 5.1 to 5.3).

The parameters are those of (5.3): mass, centre of mass c̄ and inertia I* of a link about the joint that carries it, in
link axes. Their effect on the joint torques is differentiated exactly, state by state, so that the tables of the source
can be compared with its own model.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from model.dynamics.dual import DUAL_STEP
from model.dynamics.recursive import inverse_dynamics
from model.kinematics.chain import Chain, ChainArrays, ChainError, FloatArray, JointKind

PARAMETERS = ("m", "cx", "cy", "cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""Names of the ten inertial parameters of a link, about the joint that carries it."""

NEGLIGIBLE = 1e-12
"""Share of the largest sensitivity below which a sensitivity counts as rounding."""

State = tuple[FloatArray, FloatArray, FloatArray]
"""Joint angles, rates and accelerations, each (n,)."""


def torque_sensitivities(chain: Chain, state: State) -> FloatArray:
    """Returns ∂τ/∂parameter at one state, (n torques, n links, 10 parameters), in SI units.

    Raises:
        ChainError: if a joint is prismatic; the joint that carries such a link is not a point of it.
    """
    _only_revolute(chain)
    n = chain.joint_count
    own = np.array([parameters_about_joint(chain, link) for link in range(1, n + 1)])
    q, velocity, acceleration = (np.asarray(x, dtype=np.complex128) for x in state)
    result = np.empty((n, n, len(PARAMETERS)))
    for link in range(n):
        for parameter in range(len(PARAMETERS)):
            stepped = own.astype(np.complex128)
            stepped[link, parameter] += 1j * DUAL_STEP
            torque = inverse_dynamics(_with_parameters(chain, stepped), q, velocity, acceleration)
            result[:, link, parameter] = torque.imag / DUAL_STEP
    return result


def acting_parameters(chain: Chain, states: Iterable[State]) -> list[list[str]]:
    """Returns names of the parameters that act on each joint's torque in any of the states, such as "m3" or "I2zz".

    One list per joint, in the order of the links. Raises as `torque_sensitivities`.
    """
    largest = np.max([np.abs(torque_sensitivities(chain, state)) for state in states], axis=0)
    acts = largest > NEGLIGIBLE * largest.max()
    return [
        [parameter_name(int(link) + 1, int(which)) for link, which in np.argwhere(acts[joint])]
        for joint in range(chain.joint_count)
    ]


def parameter_name(link: int, which: int) -> str:
    """Returns the name of a parameter with its link's number: m3, c3x, I3yy."""
    name = PARAMETERS[which]
    return f"{name[0]}{link}{name[1:]}"


def parameters_about_joint(chain: Chain, link: int) -> FloatArray:
    """Returns m, c̄ and I* of a link (numbered from 1, load included in the last) about the joint that carries it,
    (10,).
    """
    arrays = chain.arrays()
    body = arrays.inertial[link - 1]
    shift = _origin_from_joint(chain, link)
    mass, first = body[0], body[1:4]
    centre = shift + (first / mass if mass > 0 else 0.0)
    return np.concatenate(([mass], centre, body[4:] + _steiner(mass, first, shift)))


def _with_parameters(chain: Chain, parameters: NDArray[np.complex128]) -> ChainArrays:
    """Returns the packed chain in dual numbers with its links' parameters about their joints replaced."""
    packed = chain.arrays(np.complex128)
    for i, (mass, *centre) in enumerate(parameters[:, :4]):
        shift = _origin_from_joint(chain, i + 1)
        first = mass * (np.array(centre) - shift)
        packed.inertial[i] = np.concatenate(([mass], first, parameters[i, 4:] - _steiner(mass, first, shift)))
    return packed


def _steiner(mass: complex, first: NDArray, shift: FloatArray) -> NDArray:
    """Returns the increase of an inertia when its reference point moves by −shift, as xx xy xz yy yz zz."""
    along = 2.0 * (first @ shift) + mass * (shift @ shift)
    gain = along * np.eye(3) - np.outer(first, shift) - np.outer(shift, first) - mass * np.outer(shift, shift)
    return np.asarray(gain[np.triu_indices(3)])


def _origin_from_joint(chain: Chain, link: int) -> FloatArray:
    """Returns the origin of a link's frame from the previous one, in link axes: p of (7.11) to (7.13)."""
    joint = chain.joints[link - 1]
    return np.array([joint.a, joint.d * np.sin(joint.alpha), joint.d * np.cos(joint.alpha)])


def _only_revolute(chain: Chain) -> None:
    for number, joint in enumerate(chain.joints, start=1):
        if joint.kind is not JointKind.REVOLUTE:
            raise ChainError(f"joint {number} is prismatic; parameters about the joint need revolute joints")
