"""`python -m model.generation [--check]`: write the generated dynamics, or say whether they are up to date."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

_MODULE = Path(__file__).resolve().parents[1] / "dynamics" / "three_joint.py"


def main() -> int:
    """Run the command; 1 if `--check` finds a stale file."""
    parser = argparse.ArgumentParser(prog="python -m model.generation", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if the generated file is stale")
    if parser.parse_args().check:
        return _check()
    from model.generation.derivation import derive, in_effective_parameters
    from model.generation.expressions import routines
    from model.generation.printing import python_module

    _MODULE.write_text(python_module(routines(in_effective_parameters(derive()))), encoding="utf-8")
    sys.stdout.write(f"wrote {_MODULE.name}\n")
    return 0


def _check() -> int:
    from model.generation.printing import source_hash

    if _MODULE.exists() and source_hash() in _MODULE.read_text(encoding="utf-8"):
        return 0
    sys.stderr.write(f"{_MODULE.name} does not belong to its sources; run python -m model.generation\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
