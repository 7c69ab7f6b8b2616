"""Random but physical chains and states for the tests and benchmarks of the dynamics."""

import numpy as np

from model.dynamics.effective_inertia import lump
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


def effective_parameters(chain: Chain) -> FloatArray:
    """Effective parameters (22,) of a chain with the geometry of the closed form, from any links."""
    arrays = chain.arrays()
    links = np.array([_about_joint(arrays.geometry[i], arrays.inertial[i], i == 0) for i in range(3)])
    shoulder = chain.joints[1]
    return np.asarray(lump(links, shoulder.a, shoulder.d, arrays.rotor_inertia, arrays.gravity))


def _about_joint(geometry: FloatArray, inertial: FloatArray, waist: bool) -> FloatArray:
    """A link's ten parameters about the joint that carries it, x along the link, z along the joint's axis.

    Link 1 is wanted in the axes of its own frame instead (y along the waist), where α has already been applied.
    """
    _, d, a, alpha = geometry
    mass, first = inertial[0], inertial[1:4]
    tensor = np.zeros((3, 3))
    tensor[np.triu_indices(3)] = inertial[4:]
    tensor = tensor + np.triu(tensor, 1).T
    untwist = np.array([[1, 0, 0], [0, np.cos(alpha), -np.sin(alpha)], [0, np.sin(alpha), np.cos(alpha)]])
    if waist:
        # the crossing of waist and shoulder axes is the origin of frame 1 itself
        return np.concatenate(([mass], first, tensor[np.triu_indices(3)]))
    first, tensor = untwist @ first, untwist @ tensor @ untwist.T
    # joint 2's offset B2 = d2 stays with the link (c̄ is measured from the joint); so does −B3 = d3
    shift = np.array([a, 0.0, d])
    tensor = tensor + 2 * float(first @ shift) * np.eye(3) - np.outer(first, shift) - np.outer(shift, first)
    tensor = tensor + mass * (float(shift @ shift) * np.eye(3) - np.outer(shift, shift))
    return np.concatenate(([mass], first + mass * shift, tensor[np.triu_indices(3)]))
