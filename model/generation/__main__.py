"""`python -m model.generation`: writes the generated dynamics."""

from __future__ import annotations

from pathlib import Path

from model.generation.derivation import derive, in_effective_parameters
from model.generation.expressions import routines
from model.generation.printing import python_module

MODULE = Path(__file__).resolve().parents[1] / "dynamics" / "three_joint.py"

if __name__ == "__main__":
    MODULE.write_text(python_module(routines(in_effective_parameters(derive()))), encoding="utf-8")
