"""The command starts fast because no heavy library is loaded before a subcommand's work begins."""

import json
import subprocess
import sys

HEAVY = ["numba", "mujoco", "matplotlib", "fastapi", "scipy"]

EVERY_SUBCOMMAND = """
import importlib, json, pkgutil, sys
import daq_cli
modules = [module.name for module in pkgutil.walk_packages(daq_cli.__path__, "daq_cli.")]
for name in modules:
    if not name.endswith("__main__"):
        importlib.import_module(name)
print(json.dumps([modules, sorted({name.partition(".")[0] for name in sys.modules})]))
"""


def test_importing_the_command_line_and_every_subcommand_loads_no_heavy_library() -> None:
    program = [sys.executable, "-c", EVERY_SUBCOMMAND]
    run = subprocess.run(program, check=True, capture_output=True, text=True, timeout=60)
    modules, loaded = json.loads(run.stdout)
    assert "daq_cli.app.command" in modules
    assert [name for name in HEAVY if name in loaded] == []
