"""Lists the benchmarks, or runs some of them.

python -m benchmarks                      the list
python -m benchmarks NAME [options]       one of them, with its own options
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent


def benchmarks() -> dict[str, str]:
    """Returns every benchmark (a module or package here that can be run) and its first line."""
    found = {}
    for path in sorted([*FOLDER.glob("*.py"), *FOLDER.glob("*/__main__.py")]):
        name = path.stem if path.parent == FOLDER else path.parent.name
        source = path.read_text("utf-8")
        if name != "__main__" and '__name__ == "__main__"' in source:
            found[name] = (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]
    return dict(sorted(found.items()))


def run(name: str, options: list[str], run_process: Callable[..., Any] = subprocess.run) -> int:
    """Runs one benchmark in a separate process, so that none inherits threads, priorities or caches; returns its exit
    code.

    A benchmark that a signal ended has missed its target: 1.
    """
    code: int = run_process([sys.executable, "-m", f"benchmarks.{name}", *options], check=False).returncode
    return max(code, 1) if code else 0


def main(arguments: list[str], run_process: Callable[..., Any] = subprocess.run) -> int:
    """Returns 0 if every target was met, 1 if one was missed, 2 for an unknown name."""
    known = benchmarks()
    if not arguments or arguments[0] in ("-h", "--help"):
        print((__doc__ or "").rstrip() + "\n")
        for name, line in known.items():
            print(f"  {name:<18} {line}")
        return 0
    name, *options = arguments
    name = name.replace("-", "_")
    if name not in known:
        print(f"benchmark {name!r}: not known; available: {', '.join(known)}", file=sys.stderr)
        return 2
    return run(name, options, run_process)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
