"""Print routines as compiled Python."""

from __future__ import annotations

import subprocess
import sys

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from model.dynamics import effective_inertia
from model.generation.derivation import ANGLES
from model.generation.expressions import ANGLE_23, RATE_23, Routine


class _PythonPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Small integer powers as products: no call, and exact for dual numbers."""

    def _print_Pow(self, expression: sp.Pow) -> str:  # noqa: N802 (the name SymPy calls)
        base, exponent = expression.as_base_exp()
        if not (exponent.is_Integer and 2 <= int(exponent) <= 4 and base.is_Symbol):
            raise ValueError(f"{expression} is not a small power of a symbol")
        return "(" + "*".join([self._print(base)] * int(exponent)) + ")"

    def _print_Integer(self, expression: sp.Integer) -> str:  # noqa: N802
        return f"{int(expression)}.0"


_PYTHON_HEADER = '''"""Closed-form dynamics of the waist-shoulder-elbow arm. Generated: do not edit.

`python -m model.generation` derives and writes this file; the derivation is in `model/generation`. Angles are D-H
angles in rad, rates in rad/s, results in N·m and kg·m². `p` is the vector of effective inertial parameters laid out
in `model.dynamics.effective_inertia`. Real or dual numbers; nothing is allocated.
"""

# ruff: noqa: PLR0915  (straight-line code is as long as it is)

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model.dynamics.compilation import inlined
from model.dynamics.dual import sin_cos
'''


def python_module(routines: tuple[Routine, ...]) -> str:
    """Text of `model/dynamics/three_joint.py`."""
    body = _formatted("\n\n".join(_python_function(r) for r in routines))
    return f"{_PYTHON_HEADER}\n\n{body}"


def _formatted(source: str) -> str:
    """Source as the repository's formatter leaves it, so that formatting everything changes nothing here."""
    command = [sys.executable, "-m", "ruff", "format", "--stdin-filename", "three_joint.py", "-"]
    return subprocess.run(command, input=source, capture_output=True, text=True, check=True).stdout


def _python_function(routine: Routine) -> str:
    printer = _PythonPrinter({"standard": "python3"})
    arguments = "".join(f"    {a}: complex,\n" for a in routine.arguments)
    lines = [
        f"@inlined\ndef {routine.name}(\n{arguments}    p: NDArray[Any],\n) -> Any:",
        f'    """{routine.purpose}\n\n    Returns {", ".join(routine.results)}.\n    """',
        *(f"    {p.name} = p[{effective_inertia.NAMES.index(p.name.upper())}]" for p in routine.parameters),
        *(f"    {line}" for line in _sums(routine)),
    ]
    lines += [f"    s{_suffix(a)}, c{_suffix(a)} = sin_cos({a.name})" for a in routine.angles]
    lines += [f"    {name} = {_unbroken(printer, e)}" for name, e in routine.assignments]
    lines.append(f"    return {', '.join(routine.results)}\n")
    return "\n".join(lines)


def _sums(routine: Routine) -> list[str]:
    """Assignments of the absolute angle and rate of link 3, where they are used."""
    sums = [f"{ANGLE_23.name} = {ANGLES[1].name} + {ANGLES[2].name}"] if ANGLE_23 in routine.angles else []
    if routine.uses_rates:
        sums.append(f"{RATE_23.name} = rate_2 + rate_3")
    return sums


def _suffix(angle: sp.Symbol) -> str:
    return angle.name.removeprefix("theta_")


def _unbroken(printer: PythonCodePrinter, expression: sp.Expr) -> str:
    return " ".join(printer.doprint(expression).split())
