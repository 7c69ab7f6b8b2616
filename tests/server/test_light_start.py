"""The service starts without the libraries that only its worker processes and the mock need."""

import subprocess
import sys


def test_the_web_server_and_the_owner_of_the_port_load_no_compiler_no_physics_engine_and_no_http_client() -> None:
    heavy = ("numba", "scipy", "mujoco", "matplotlib", "httpx")
    for module in ("server.serve", "server.owner"):
        line = f"import sys, {module}; print(*[name for name in {heavy} if name in sys.modules])"
        told = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True)
        assert told.stdout.split() == [], module
