"""From symbolic dynamics to short straight-line code.

The dynamics are rewritten in the absolute angle of link 3, θ23 = θ2 + θ3, and its rate: in these the kinetic energy
has fewer terms, and the torques of shoulder and elbow share all but two products. Sines and cosines become plain
symbols, then common subexpressions are taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from model.generation.derivation import ANGLES, EFFECTIVE, RATES, Dynamics

ANGLE_23 = sp.Symbol("theta_23", real=True)
RATE_23 = sp.Symbol("rate_23", real=True)
_TRIGONOMETRY = {
    angle: (sp.Symbol(f"s{name}"), sp.Symbol(f"c{name}"))
    for angle, name in ((ANGLES[0], "1"), (ANGLES[1], "2"), (ANGLE_23, "23"))
}
_P = {symbol.name.upper(): symbol for symbol in EFFECTIVE}

INERTIA_NAMES = ("d11", "d12", "d13", "d22", "d23", "d33")
BIAS_NAMES = ("b1", "b2", "b3")


@dataclass(frozen=True)
class Routine:
    """One function to be printed: its inputs, assignments in order, and the names it returns.

    `angles` says which sines and cosines the assignments use: they are computed first.
    """

    name: str
    purpose: str
    arguments: tuple[str, ...]
    angles: tuple[sp.Symbol, ...]
    assignments: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[str, ...]

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Effective parameters that occur in it, in the order of the vector."""
        used = set().union(*(expression.free_symbols for _, expression in self.assignments))
        return tuple(p for p in EFFECTIVE if p in used)

    @property
    def uses_rates(self) -> bool:
        """Whether joint rates are among the arguments."""
        return RATES[0].name in self.arguments


def routines(dynamics: Dynamics) -> tuple[Routine, ...]:
    """The functions of the generated module."""
    inertia = _inertia(dynamics)
    velocity = _velocity(dynamics)
    vertical = _gravity(dynamics, ("GRAVITY_X", "GRAVITY_Y"))
    horizontal = _gravity(dynamics, ("GRAVITY_Z",))
    everything = [a + b for a, b in zip(vertical, horizontal, strict=True)]
    bias = [a + b for a, b in zip(velocity, vertical, strict=True)]
    arm, whole = (ANGLES[1], ANGLE_23), (ANGLES[0], ANGLES[1], ANGLE_23)
    names = tuple(a.name for a in ANGLES)
    rates = tuple(r.name for r in RATES)
    return (
        _routine(
            "mass_matrix_and_bias",
            "D and b = H + G for gravity along z0 (components x and y of gravity are left out).",
            (names[1:] + rates, arm, INERTIA_NAMES + BIAS_NAMES),
            inertia + bias,
        ),
        _routine("gravity_torques", "G for gravity of any direction.", (names, whole, BIAS_NAMES), everything),
        _routine(
            "horizontal_gravity_torques",
            "The part of G that a tilted base adds: components x and y of gravity only.",
            (names, whole, BIAS_NAMES),
            horizontal,
        ),
    )


def _inertia(dynamics: Dynamics) -> list[sp.Expr]:
    d = dynamics.inertia
    upper = [d[0, 0], d[0, 1], d[0, 2], d[1, 1], d[1, 2], d[2, 2]]
    return [_group(_polynomial(e)) for e in upper]


def _velocity(dynamics: Dynamics) -> list[sp.Expr]:
    """H by the Christoffel symbols of D in the coordinates (θ1, θ2, θ23), carried back to the joints."""
    to_joint = sp.Matrix([[1, 0, 0], [0, 1, 0], [0, 1, 1]])  # rates (1, 2, 23) from rates (1, 2, 3)
    back = to_joint.inv()
    absolute = (back.T * dynamics.inertia * back).applyfunc(lambda e: sp.expand(_polynomial(e)))
    angles, rates = (ANGLES[0], ANGLES[1], ANGLE_23), (RATES[0], RATES[1], RATE_23)
    torque = sp.zeros(3, 1)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                slope = _slope(absolute[i, j], angles[k]) - _slope(absolute[j, k], angles[i]) / 2
                torque[i] += _group(sp.expand(slope)) * rates[j] * rates[k]
    torque = torque.applyfunc(_collect_rates)
    return [torque[0], torque[1] + torque[2], torque[2]]


def _gravity(dynamics: Dynamics, left_out: tuple[str, ...]) -> list[sp.Expr]:
    kept = dynamics.gravity_torques.subs({_P[name]: 0 for name in left_out})
    own = [_group(sp.expand(_polynomial(kept[0]))), *(sp.expand(_polynomial(kept[i])) for i in (1, 2))]
    shoulder_only = _group(sp.expand(own[1] - own[2]))
    return [own[0], shoulder_only + _group(own[2]), _group(own[2])]


def _polynomial(expression: sp.Expr) -> sp.Expr:
    """Replace angles by sines and cosines of θ1, θ2 and θ23; squares of sines by those of cosines."""
    result = sp.expand(sp.expand_trig(sp.sympify(expression).subs(ANGLES[2], ANGLE_23 - ANGLES[1])))
    for angle, (s, c) in _TRIGONOMETRY.items():
        result = result.subs({sp.sin(angle): s, sp.cos(angle): c})
    result = sp.expand(result)
    for s, c in _TRIGONOMETRY.values():
        result = sp.expand(sp.rem(result, s**2 + c**2 - 1, s))
    return result


def _slope(polynomial: sp.Expr, angle: sp.Symbol) -> sp.Expr:
    s, c = _TRIGONOMETRY[angle]
    return polynomial.diff(s) * c - polynomial.diff(c) * s


def _collect_rates(torque: sp.Expr) -> sp.Expr:
    """Σ over products of rates, each with its coefficient grouped."""
    expanded = sp.expand(torque)
    rates = (*RATES[:2], RATE_23)
    products = [a * b for n, a in enumerate(rates) for b in rates[n:]]
    polynomial = sp.Poly(expanded, *rates)
    terms = [(product, polynomial.coeff_monomial(product)) for product in products]
    return sp.Add(*(product * _group(coefficient) for product, coefficient in terms if coefficient != 0))


def _group(polynomial: sp.Expr) -> sp.Expr:
    """Write a polynomial so that the moments of link 3 turned by θ23 stand together, as they recur everywhere."""
    s2, c2 = _TRIGONOMETRY[ANGLES[1]]
    expanded = sp.expand(polynomial)
    length = _P["LENGTH_2"]
    result = sp.Integer(0)
    for power_of_length in (length, sp.Integer(1)):
        part = expanded.coeff(length, 1) if power_of_length is length else expanded.coeff(length, 0)
        grouped = sp.collect(part, (s2 * c2, c2**2, s2, c2), evaluate=False)
        for factor, rest in grouped.items():
            result += power_of_length * factor * _by_gravity(rest)
    return result


def _by_gravity(expression: sp.Expr) -> sp.Expr:
    gravity = [_P[name] for name in ("GRAVITY_X", "GRAVITY_Y", "GRAVITY_Z")]
    return sp.Add(*(k * sp.factor_terms(v) for k, v in sp.collect(expression, gravity, evaluate=False).items()))


def _routine(
    name: str,
    purpose: str,
    signature: tuple[tuple[str, ...], tuple[sp.Symbol, ...], tuple[str, ...]],
    expressions: list[sp.Expr],
) -> Routine:
    arguments, angles, results = signature
    temporaries = sp.numbered_symbols("t")
    replaced, reduced = sp.cse(expressions, symbols=temporaries, optimizations="basic", order="canonical")
    last = zip((sp.Symbol(r) for r in results), reduced, strict=True)
    return Routine(name, purpose, arguments, angles, (*replaced, *last), results)
