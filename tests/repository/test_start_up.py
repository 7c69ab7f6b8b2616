"""The command starts fast because it loads no heavy library before it is needed."""

import json
import subprocess
import sys

HEAVY = ["numba", "mujoco", "matplotlib", "fastapi", "scipy"]


def test_importing_the_command_line_loads_no_heavy_library() -> None:
    program = "import daq.cli, json, sys; print(json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))"
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, timeout=60)
    loaded = json.loads(run.stdout)
    assert "daq" in loaded
    assert [name for name in HEAVY if name in loaded] == []
