"""Imports, checks, fits and diagnoses a record by the command line: what works without a serial port, on any system.

`python tests/repository/at_the_desk.py` in a checkout is the test on macOS and Windows. With `--as-windows`, this
Python first loses the modules and functions that Windows lacks, and our modules are imported as there.
"""

import builtins
import ctypes
import importlib
import os
import pkgutil
import select
import signal
import socket
import subprocess
import sys
import tempfile
import types
import warnings
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = ("extras.formats",) if (ROOT / "extras").exists() else ()
OURS = ("daq.contracts", "daq.traces", "daq.config", "model", "daq_cli", "ma2000", *EXTRAS)
"""Packages that read, fit and diagnose, or lead there."""
FOREIGN = (
    "asyncio concurrent.futures.process httpx jinja2 matplotlib.backends.backend_agg mcap.writer multiprocessing.pool "
    "mujoco numba pandas pint platformdirs pyarrow.parquet pydantic_settings rich.console rosbags.highlevel scipy.io "
    "scipy.optimize scipy.signal serial.tools.list_ports typer tzlocal websockets xarray"
)
"""Modules of others, imported before this Python loses what is POSIX's own."""
POSIX_MODULES = "fcntl grp pty pwd resource syslog termios tty uvloop"
POSIX_NAMES: tuple[tuple[Any, str], ...] = (
    (os, "O_DIRECTORY O_NONBLOCK fork getuid openpty sched_getaffinity set_blocking"),
    (signal, "SIGALRM SIGHUP SIGTSTP SIGUSR1"),
    (socket, "AF_UNIX"),
    (select, "poll"),
)


def become_windows() -> None:
    """Imports all of ours as on Windows, whose own modules are stand-ins."""
    for name in FOREIGN.split():
        importlib.import_module(name)
    for name in POSIX_MODULES.split():
        sys.modules[name] = None  # type: ignore[assignment]
    for module, names in POSIX_NAMES:
        for name in names.split():
            delattr(module, name)
    locks = types.SimpleNamespace(LockFileEx=lambda *_: 1)
    ctypes.WinDLL = lambda *_, **__: locks  # type: ignore[attr-defined]
    sys.modules["msvcrt"] = types.SimpleNamespace(get_osfhandle=lambda number: number)  # type: ignore[assignment]
    system, sys.platform = sys.platform, "win32"
    for package in OURS:
        for found in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not found.name.endswith("__main__"):
                importlib.import_module(found.name)
    sys.platform = system


def daq(*arguments: str) -> None:
    """Runs a command; raises AssertionError if it fails."""
    from daq_cli import main

    print("$ daq", *arguments)
    sys.argv = ["daq", *arguments]
    code: Any = None
    try:
        main()
    except SystemExit as ended:
        code = ended.code
    assert not code, f"daq {' '.join(arguments)} ended with {code}"


def main() -> None:
    """Works in an empty folder."""
    # A text file is UTF-8 here, never what the system prefers: `python -X warn_default_encoding` says where it is not.
    ours = r"(daq|daq_cli|model|ma2000|extras|firmware_protocol)\b"
    warnings.filterwarnings("error", category=builtins.EncodingWarning, module=ours)
    if "--as-windows" in sys.argv:
        become_windows()
    import ma2000

    assert [getattr(ma2000, name) for name in ma2000.__all__]
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            rig = [sys.executable, str(ROOT / "examples" / "motor_bench_rig.py"), "rig"]
            subprocess.run(rig, check=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
            machine = str(ROOT / "examples" / "motor_bench.toml")
            first, second = sorted(str(path) for path in Path("rig").glob("*.csv"))[:2]
            daq("traces", "import", first)
            daq("traces", "ls")
            daq("check", first, "--model", machine)
            daq("fit", first, "--model", machine, "-o", "fitted.json")
            daq("diagnose", first, "--holdout", second, "--model", machine, "--report", "report.html")
            assert Path("fitted.json").is_file()
            assert Path("report.html").is_file()
        finally:
            os.chdir(ROOT)


if __name__ == "__main__":
    main()
