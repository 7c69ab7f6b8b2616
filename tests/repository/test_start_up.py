"""Programs start fast because no heavy library is loaded before their work begins."""

import subprocess
import sys

import pytest

EVERY_SUBCOMMAND = """
import pkgutil, daq_cli
for module in pkgutil.walk_packages(daq_cli.__path__, "daq_cli."):
    if not module.name.endswith("__main__"):
        __import__(module.name)
"""


@pytest.mark.parametrize(
    ("program", "without"),
    [
        pytest.param(EVERY_SUBCOMMAND, {"numba", "mujoco", "matplotlib", "fastapi", "scipy"}, id="every subcommand"),
        pytest.param("import ma2000", {"numpy", "pydantic", "email"}, id="the package"),
        pytest.param("import daq_cli.app.early_stop", {"numpy", "pydantic", "typer"}, id="a stop"),
        pytest.param(
            "import server.stopping.process", {"sqlalchemy", "fastapi", "uvicorn", "numpy"}, id="the stop listener"
        ),
    ],
)
def test_nothing_heavy_is_loaded_before_it_is_needed(program: str, without: set[str]) -> None:
    told = "import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", f"{program}\n{told}"], check=True, capture_output=True, text=True, timeout=60
    )
    assert without & set(done.stdout.split()) == set()
