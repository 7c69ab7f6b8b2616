"""Size, number of packages and import time of each extra, in fresh environments.

python -m benchmarks installed_size [EXTRA ...] [--wheel FILE]

Needs a network, or uv's cache. Versions are those of requirements-dev.txt. Sizes are without the bytecode that Python
writes at the first import.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figures import machine
from benchmarks.startup import fastest

ROOT = Path(__file__).parents[1]
UV = Path(sys.executable).with_name("uv")
MB = 1_000_000
OWN_USE = {
    "live": "import ma2000, websockets.sync.client; ma2000.Client",
    "robot": "import ma2000; ma2000.run",
    "model": "import ma2000; ma2000.fit; ma2000.diagnose",
    "server": "import server.serve",
    "tables": "import ma2000, pandas, xarray; ma2000.Trace",
    "ros": "import ma2000, rosbags.highlevel; ma2000.read_trace",
    "cluster": "import ma2000, distributed; ma2000.Trace",
    "postgresql": "import ma2000, psycopg; ma2000.Trace",
    "archive": "import ma2000, obstore; ma2000.Trace",
    "oidc": "import ma2000, authlib.oidc.core; ma2000.Trace",
    "all": "import ma2000, server.serve; ma2000.run; ma2000.diagnose",
}
"""What each extra is installed for; of a client: to read traces."""
CLIENT_USE = "import ma2000; ma2000.read_trace; ma2000.Client"


@dataclass(frozen=True)
class Measured:
    """An installation: its packages, their size (MB), and times (s) from the start of Python."""

    extra: str
    packages: int
    size: float
    beyond_client: float
    own_use: float


def wheel(folder: Path) -> Path:
    """Builds this tree's wheel."""
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (file,) = folder.glob("*.whl")
    return file


def measure(file: Path, extra: str, folder: Path, client: float, repeats: int) -> Measured:
    """Installs the wheel with an extra into a new environment, and measures it.

    Args:
        client: size (MB) of a client's installation; 0 for that itself.
    """
    quiet = [str(UV), "--quiet"]
    subprocess.run([*quiet, "venv", "--python", sys.executable, str(folder)], check=True)
    empty = _size(folder)
    pins = ["--constraint", str(ROOT / "requirements-dev.txt")]
    subprocess.run([*quiet, "pip", "install", "--python", str(folder), *pins, f"{file}[{extra}]"], check=True)
    size = (_size(folder) - empty) / MB
    packages = len(list(folder.glob("lib/python*/site-packages/*.dist-info")))
    python = [str(folder / "bin" / "python"), "-c"]
    use = [*python, OWN_USE.get(extra, CLIENT_USE)]
    subprocess.run(use, check=True, cwd=folder)  # writes the bytecode
    return Measured(extra, packages, size, size - client if client else 0.0, fastest(use, repeats))


def _size(folder: Path) -> int:
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")


def main() -> int:
    """The exit code: 0."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    parser = argparse.ArgumentParser(prog="python -m benchmarks installed_size", description=__doc__)
    parser.add_argument("extras", nargs="*", metavar="EXTRA", help=f"of {', '.join(extras)} (default: all of them)")
    parser.add_argument("--wheel", type=Path, help="of this file, which is else built")
    parser.add_argument("--repeats", type=int, default=7)
    given = parser.parse_args()
    if unknown := set(given.extras) - set(extras):
        parser.error(f"no such extra: {', '.join(sorted(unknown))}; there are {', '.join(extras)}")
    print(f"{machine()}; `python -c pass`: {fastest([sys.executable, '-c', 'pass'], given.repeats):.2f} s\n")
    print("| extra | packages | installed, MB | more than `client`, MB | from start to use, s |\n|---|---|---|---|---|")
    client = 0.0
    with tempfile.TemporaryDirectory() as folder:
        file = given.wheel or wheel(Path(folder) / "wheel")
        for extra in ["client", *(one for one in given.extras or extras if one != "client")]:
            found = measure(file, extra, Path(folder) / extra, client, given.repeats)
            client = client or found.size
            cells = (found.packages, f"{found.size:.0f}", f"{found.beyond_client:.0f}", f"{found.own_use:.2f}")
            print(f"| `{extra}` | {' | '.join(map(str, cells))} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
