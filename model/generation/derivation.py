"""Equations of motion of the waist-shoulder-elbow arm, derived symbolically from its D-H transforms.

D from the kinetic energy, H from the Christoffel symbols of D, G from the potential energy: nothing here is
shared with the recursive Newton-Euler code that the result is checked against. Links are general rigid bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from model.dynamics import effective_inertia

ANGLES = sp.symbols("theta_1 theta_2 theta_3", real=True)
RATES = sp.symbols("rate_1 rate_2 rate_3", real=True)
LENGTH_2, OFFSET_2 = sp.symbols("length_2 offset_2", real=True)
ROTORS = sp.symbols("rotor_1 rotor_2 rotor_3", real=True)
GRAVITY = sp.symbols("gravity_x gravity_y gravity_z", real=True)
LINKS = tuple(
    sp.symbols(f"m{i} s{i}x s{i}y s{i}z i{i}xx i{i}xy i{i}xz i{i}yy i{i}yz i{i}zz", real=True) for i in (1, 2, 3)
)
EFFECTIVE = tuple(sp.Symbol(name.lower(), real=True) for name in effective_inertia.NAMES)


@dataclass(frozen=True)
class Dynamics:
    """D (3 × 3), H (3) and G (3) as expressions of angles, rates and parameters."""

    inertia: sp.Matrix
    velocity_torques: sp.Matrix
    gravity_torques: sp.Matrix


def derive() -> Dynamics:
    """Dynamics in the links' own 30 inertial parameters, rotors and geometry."""
    inertia = sp.diag(*ROTORS)
    potential = sp.Integer(0)
    for link, pose in zip(LINKS, _poses_at_joints(), strict=True):
        slopes = [pose.diff(angle) for angle in ANGLES]
        moments = _second_moments(link)
        inertia += sp.Matrix(3, 3, lambda j, k, s=slopes, m=moments: (s[j] * m * s[k].T).trace())
        first_moment = (pose * moments)[:3, 3]
        potential -= (sp.Matrix(GRAVITY).T * first_moment)[0]
    inertia = inertia.applyfunc(_compact)
    return Dynamics(inertia, _velocity_torques(inertia), sp.Matrix([potential.diff(a) for a in ANGLES]))


def effective_values() -> dict[sp.Symbol, sp.Expr]:
    """Effective parameters in terms of the links' own: the function that the numeric code uses, run on symbols."""
    import numpy as np

    values = effective_inertia.lump.py_func(
        np.array(LINKS, dtype=object), LENGTH_2, OFFSET_2, np.array(ROTORS), np.array(GRAVITY)
    )
    return dict(zip(EFFECTIVE, (sp.expand(v) for v in values), strict=True))


def in_effective_parameters(full: Dynamics) -> Dynamics:
    """The same dynamics written in the effective parameters.

    Parameters that were lumped into others are set to zero and the rest take the effective values; that this
    leaves D, H and G unchanged is proved here, term by term.

    Raises:
        ValueError: if the lumping is wrong.
    """
    p = {symbol.name.upper(): symbol for symbol in EFFECTIVE}
    kept = {"s1x": "S1_X", "s1z": "S1_Z", "i1yy": "WAIST"}
    for link in (2, 3):
        kept |= {f"s{link}{axis}": f"S{link}_{axis.upper()}" for axis in ("x", "y")}
        kept |= {f"i{link}{axes}": f"I{link}_{axes.upper()}" for axes in ("xy", "xz", "yz", "zz")}
        kept[f"i{link}yy"] = f"I{link}_YY_XX"
    own = {s: p[kept[s.name]] if s.name in kept else sp.Integer(0) for link in LINKS for s in link}
    own |= {ROTORS[0]: sp.Integer(0), ROTORS[1]: sp.Integer(0), ROTORS[2]: p["ROTOR_3"]}
    own |= {OFFSET_2: sp.Integer(0), LENGTH_2: p["LENGTH_2"]}
    own |= {g: p[g.name.upper()] for g in GRAVITY}
    inertia = full.inertia.subs(own).applyfunc(_compact)
    lumped = Dynamics(inertia, _velocity_torques(inertia), full.gravity_torques.subs(own))
    _prove_equal(full, lumped)
    return lumped


def _poses_at_joints() -> list[sp.Matrix]:
    """Transform of each link's axes, with origin at the joint that carries it, to the base (3.7, 3.9)."""
    poses = []
    before = sp.eye(4)
    twists = (sp.pi / 2, sp.Integer(0), sp.Integer(0))
    translations = ((0, 0), (LENGTH_2, OFFSET_2), (0, 0))  # (a, d); those of joint 3 move no link's joint
    for angle, twist, (a, d) in zip(ANGLES, twists, translations, strict=True):
        c, s, ca, sa = sp.cos(angle), sp.sin(angle), sp.cos(twist), sp.sin(twist)
        turn = sp.Matrix([[c, -ca * s, sa * s, 0], [s, ca * c, -sa * c, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        poses.append(before * turn)
        before = before * turn * sp.Matrix([[1, 0, 0, a], [0, 1, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
    return poses


def _second_moments(link: tuple[sp.Symbol, ...]) -> sp.Matrix:
    """4 × 4 matrix of second, first and zeroth moments of mass of a link from its inertia tensor."""
    m, sx, sy, sz, xx, xy, xz, yy, yz, zz = link
    return sp.Matrix(
        [
            [(yy + zz - xx) / 2, -xy, -xz, sx],
            [-xy, (xx + zz - yy) / 2, -yz, sy],
            [-xz, -yz, (xx + yy - zz) / 2, sz],
            [sx, sy, sz, m],
        ]
    )


def _velocity_torques(inertia: sp.Matrix) -> sp.Matrix:
    """H_i = Σ_jk (∂D_ij/∂q_k − ½ ∂D_jk/∂q_i) q̇_j q̇_k."""
    rows = []
    for i in range(3):
        row = sum(
            (inertia[i, j].diff(ANGLES[k]) - inertia[j, k].diff(ANGLES[i]) / 2) * RATES[j] * RATES[k]
            for j in range(3)
            for k in range(3)
        )
        rows.append(row)
    return sp.Matrix(rows)


def _compact(expression: sp.Expr) -> sp.Expr:
    """Collect per parameter and write the trigonometric factor of each as briefly as SymPy can."""
    expanded = sp.expand(expression)
    linear = sorted((s for link in LINKS for s in link), key=str) + list(EFFECTIVE)
    collected = sp.collect(expanded, linear, evaluate=False)
    return sp.Add(*(term * sp.trigsimp(factor) for term, factor in collected.items()))


def _prove_equal(full: Dynamics, lumped: Dynamics) -> None:
    values = effective_values()
    pairs = [(name, getattr(full, name), getattr(lumped, name)) for name in full.__dataclass_fields__]
    for name, own, effective in pairs:
        difference = (own - effective.subs(values)).applyfunc(lambda e: sp.simplify(sp.expand_trig(sp.expand(e))))
        if any(difference):
            raise ValueError(f"{name} changes when inertial parameters are lumped: {difference}")
