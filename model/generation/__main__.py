"""`python -m model.generation [--check]`: write the generated dynamics, or say whether they are up to date."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

_MODULE = Path(__file__).resolve().parents[1] / "dynamics" / "three_joint.py"
_HEADER = Path(__file__).resolve().parents[2] / "benchmarks" / "three_joint.h"


def main() -> int:
    """Run the command; 1 if `--check` finds a stale file."""
    parser = argparse.ArgumentParser(prog="python -m model.generation", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if a generated file is stale")
    if parser.parse_args().check:
        return _check()
    from model.generation.derivation import derive, in_effective_parameters
    from model.generation.expressions import routines
    from model.generation.printing import c_header, python_module

    all_routines = routines(in_effective_parameters(derive()))
    _MODULE.write_text(python_module(all_routines), encoding="utf-8")
    _HEADER.parent.mkdir(exist_ok=True)
    _HEADER.write_text(c_header(all_routines), encoding="utf-8")
    sys.stdout.write(f"wrote {_MODULE.name} and {_HEADER.name}\n")
    return 0


def _check() -> int:
    from model.generation.printing import source_hash

    stale = [f for f in (_MODULE, _HEADER) if not f.exists() or source_hash() not in f.read_text(encoding="utf-8")]
    for file in stale:
        sys.stderr.write(f"{file.name} does not belong to its sources; run python -m model.generation\n")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
