"""Random but physical chains and states for the tests and benchmarks of the dynamics."""

import numpy as np

from model.dynamics.rod_arm import RodArm
from model.kinematics.chain import Chain, ChainArrays, FloatArray, Joint, JointKind, Link

TABLE_7_9 = RodArm(
    mass_1=2.517390,
    radius_1=0.062899,
    mass_2=0.506972,
    mass_3=0.290461,
    load=1.250307,
    length_2=0.285755,
    length_3=0.168410,
    rotor_inertia=(600**2 * 18.3e-7, 635.5**2 * 32e-7, 333.33**2 * 18.3e-7),
)
"""The best published parameters (table 7.9) with the rotors of table 7.1 through the gears of appendix C."""

OFFSET_ARM = RodArm(
    mass_1=2.5,
    radius_1=0.06,
    mass_2=0.5,
    mass_3=0.3,
    load=1.2,
    length_2=0.29,
    length_3=0.17,
    offset_2=0.05,
    offset_3=0.03,
    shift_2=0.01,
    shift_3=-0.02,
    rotor_inertia=(0.6, 1.2, 0.2),
    gravity=(1.0, 2.0, -9.0),
)
"""An arm with every parameter in play, on a tilted base."""


def random_link(rng: np.random.Generator) -> Link:
    """A link made of five random point masses: physical by construction."""
    points = rng.normal(scale=0.3, size=(5, 3))
    masses = rng.uniform(0.1, 0.5, size=5)
    centre = masses @ points / masses.sum()
    arms = points - centre
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
    return Link(float(masses.sum()), centre, np.asarray(inertia))


def random_chain(seed: int, joints: int, kinds: str = "mixed") -> Chain:
    """A chain of `joints` joints; kinds is "revolute", "prismatic" or "mixed"."""
    rng = np.random.default_rng([seed, joints])
    choices = {"revolute": [0], "prismatic": [1], "mixed": [0, 1]}[kinds]
    kind = [(JointKind.REVOLUTE, JointKind.PRISMATIC)[rng.choice(choices)] for _ in range(joints)]
    return Chain(
        joints=tuple(
            Joint(
                k,
                a=float(rng.uniform(-0.5, 0.5)),
                alpha=float(rng.uniform(-np.pi, np.pi)),
                d=float(rng.uniform(-0.5, 0.5)),
                theta=float(rng.uniform(-np.pi, np.pi)),
                rotor_inertia=float(rng.uniform(0.0, 0.5)),
            )
            for k in kind
        ),
        links=tuple(random_link(rng) for _ in range(joints)),
        gravity=rng.normal(scale=6.0, size=3),
        load=float(rng.uniform(0.0, 2.0)),
        load_position=rng.normal(scale=0.1, size=3),
    )


def random_state(seed: int, joints: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, rate and acceleration (or torque) of every joint."""
    rng = np.random.default_rng([seed, joints, 7])
    return rng.uniform(-np.pi, np.pi, joints), rng.normal(size=joints), rng.normal(size=joints)


def dual(arrays: ChainArrays) -> ChainArrays:
    """The same chain in dual numbers with no derivative yet."""
    return ChainArrays(arrays.prismatic, *(a.astype(np.complex128) for a in arrays[1:]))
