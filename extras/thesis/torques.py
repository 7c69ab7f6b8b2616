"""Elements of D and the torques of inertia, interaction, speed and gravity along a motion (figures 7.12 to 7.14)."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from daq.contracts.frozen import FrozenRecord
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.dynamics import recursive
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate

Series = tuple[float, ...]


class InertiaElement(FrozenRecord):
    """D_ij along a motion, kg·m² (or kg), joints from 1: translation and rotation of the bodies, and rotors.

    `translation`: part of the masses at their centres; `rotation`: part of the moments about their centres.
    """

    row: int
    column: int
    whole: Series
    translation: Series
    rotation: Series
    rotor: float


class InertialTorque(FrozenRecord):
    """D_ij q̈_j: torque (N·m) at joint `at` from the acceleration of joint `of`; an interaction where they differ."""

    at: int
    of: int
    values: Series


class GravityTorque(FrozenRecord):
    """Torque of gravity (N·m) at a joint: all bodies, and by link (from 1; the load belongs to the last)."""

    joint: int
    whole: Series
    by_link: tuple[Series, ...]


class SpeedTorque(FrozenRecord):
    """Centrifugal and Coriolis torque H (N·m) at a joint."""

    joint: int
    values: Series


class TorqueAnalysis(FrozenRecord):
    """Figures 7.12 to 7.14 for any machine and motion. `source` is the origin of the motion."""

    model: str
    source: str
    time: Series
    inertia: tuple[InertiaElement, ...]
    inertial: tuple[InertialTorque, ...]
    speed: tuple[SpeedTorque, ...]
    gravity: tuple[GravityTorque, ...]

    def element(self, row: int, column: int) -> InertiaElement:
        """Returns D_ij, i ≤ j, from 1."""
        return next(e for e in self.inertia if (e.row, e.column) == (row, column))


def torques_of_run(model: Model, trace: Trace) -> TorqueAnalysis:
    """Computes torques along the model's own motion for the set points of a trace, with accelerations of its exact
    speeds."""
    run = simulate(model, trace, Options(quantise=False))
    period = float(np.median(np.diff(run.time)))
    acceleration = np.gradient(run.velocity, period, axis=0)
    return torques_along(
        model, run.time, run.position, run.velocity, acceleration, f"simulation of {trace.record.trace_id}"
    )


def torques_along(
    model: Model, time: Floats, position: Floats, speed: Floats, acceleration: Floats, source: str
) -> TorqueAnalysis:
    """Computes torques along a motion (k, n) in rad, rad/s and rad/s²; link 3 by (7.28) if the model uses it."""
    joints = range(model.joint_count)
    chain = _as_published(chain_of(model)) if model.published_inertia else chain_of(model)
    whole = np.array([recursive.mass_matrix(chain, q) for q in position])
    speed_torque = np.array([recursive.velocity_torques(chain, q, v) for q, v in zip(position, speed, strict=True)])
    inertial = [
        InertialTorque(at=i + 1, of=j + 1, values=_series(whole[:, i, j] * acceleration[:, j]))
        for i in joints
        for j in joints
    ]
    return TorqueAnalysis(
        model=model.identity,
        source=source,
        time=_series(time),
        inertia=_inertia_elements(chain, position, whole),
        inertial=tuple(inertial),
        speed=tuple(SpeedTorque(joint=i + 1, values=_series(speed_torque[:, i])) for i in joints),
        gravity=_gravity_torques(chain, position),
    )


def _inertia_elements(chain: ChainArrays, position: Floats, whole: Floats) -> tuple[InertiaElement, ...]:
    points = _without_moments(chain)
    translation = np.array([recursive.mass_matrix(points, q) for q in position])
    elements = []
    for i, j in combinations_with_replacement(range(whole.shape[1]), 2):
        rotor = float(chain.rotor_inertia[i]) if i == j else 0.0
        elements.append(
            InertiaElement(
                row=i + 1,
                column=j + 1,
                whole=_series(whole[:, i, j]),
                translation=_series(translation[:, i, j] - rotor),
                rotation=_series(whole[:, i, j] - translation[:, i, j]),
                rotor=rotor,
            )
        )
    return tuple(elements)


def _gravity_torques(chain: ChainArrays, position: Floats) -> tuple[GravityTorque, ...]:
    whole, *by_link = (
        np.array([recursive.gravity_torques(part, q) for q in position])
        for part in (chain, *(_only(chain, link) for link in range(position.shape[1])))
    )
    return tuple(
        GravityTorque(joint=i + 1, whole=_series(whole[:, i]), by_link=tuple(_series(link[:, i]) for link in by_link))
        for i in range(position.shape[1])
    )


def _without_moments(chain: ChainArrays) -> ChainArrays:
    """Returns the chain with every body's mass at its centre. A load counts as part of the last body."""
    inertial = chain.inertial.copy()
    for body in inertial:
        mass, first = body[0], body[1:4]
        centre = first / mass if mass > 0 else first
        tensor = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        body[4:] = tensor[np.triu_indices(3)]
    return chain._replace(inertial=inertial)


def _as_published(chain: ChainArrays) -> ChainArrays:
    """Returns the arm with link 3 and its load as one shifted rod, (7.20) to (7.28), whose inertia is 13 to 22 % too
    high."""
    inertial = chain.inertial.copy()
    mass, length = inertial[2, 0], chain.geometry[2, 2]
    beyond = -inertial[2, 1] / mass  # s_3x: from the common centre of mass to the end of the link
    across = mass / (3 * length) * (beyond**3 + (length - beyond) ** 3)
    more = across - (inertial[2, 9] - mass * beyond**2)
    inertial[2, 7] += more
    inertial[2, 9] += more
    return chain._replace(inertial=inertial)


def _only(chain: ChainArrays, link: int) -> ChainArrays:
    inertial = np.zeros_like(chain.inertial)
    inertial[link] = chain.inertial[link]
    return chain._replace(inertial=inertial)


def _series(values: Floats) -> Series:
    return tuple(map(float, values))


def largest(values: Series) -> float:
    """Largest magnitude of a series."""
    return float(np.abs(np.array(values)).max())
