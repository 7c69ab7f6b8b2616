"""Compiled code is kept apart for every state of the sources it is made of, and of no others."""

import ast
import errno
import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import model
from model.dynamics import compilation, recursive
from model.dynamics.compilation import (
    CACHE_DAYS,
    SharedCacheLocator,
    _remove_old,
    cache_folder,
    dependencies,
    one_process_at_a_time,
    source_hash,
)
from model.simulation import kernel

SOURCES = {
    "model/__init__.py": "",
    "model/dynamics/__init__.py": "GRAVITY = 9.8\n",
    "model/dynamics/arm.py": "from model.dynamics.constants import PI\ndef torque(): ...\n",
    "model/dynamics/constants.py": "PI = 3.14\n",
    "model/dynamics/friction.py": "LEVEL = 1.0\n",
    "model/simulation/__init__.py": "",
    "model/simulation/kernel.py": (
        "import numpy as np\n"
        "from model.dynamics import (\n    arm,\n    GRAVITY,\n)\n"
        "def run():\n    try:\n        from ..dynamics.friction import LEVEL\n    except ImportError:\n        pass\n"
    ),
    "model/reports/__init__.py": "",
    "model/reports/page.py": "from model.simulation.kernel import run\n",
    "daq/__init__.py": "",
    "numpy.py": "no module of ours\n",
}
REACHED = {name for name in SOURCES if name not in ("model/reports/__init__.py", "model/reports/page.py", "numpy.py")}
REACHED -= {"daq/__init__.py"}


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A house of modules: a kernel, what it reaches, and a report that reaches the kernel."""
    for name, text in SOURCES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


def test_a_key_is_that_of_all_that_a_kernel_imports(root: Path) -> None:
    found = dependencies("model.simulation.kernel", root)
    assert {path.relative_to(root).as_posix() for path in found.values()} == REACHED
    before = source_hash("drag_of_my_arm", root)
    report = root / "model/reports/page.py"
    report.write_text(report.read_text() + "\nMORE = 1\n")
    assert source_hash("drag_of_my_arm", root) != before
    before = source_hash("model.simulation.kernel", root)
    module = root / "model/dynamics/arm.py"
    text = module.read_text()
    module.unlink()
    (root / "model/dynamics/arm").mkdir()
    (root / "model/dynamics/arm/__init__.py").write_text(text + "from model.reports import page\n")
    assert source_hash("model.simulation.kernel", root) != before
    assert "model.reports.page" in dependencies("model.simulation.kernel", root)


@pytest.mark.parametrize("name", sorted(SOURCES))
def test_an_edit_of_what_is_compiled_gives_another_key_and_an_edit_elsewhere_does_not(root: Path, name: str) -> None:
    before = source_hash("model.simulation.kernel", root)
    path = root / name
    path.write_text(path.read_text() + "\nMORE = 1\n")
    assert (source_hash("model.simulation.kernel", root) != before) == (name in REACHED)


def test_kernels_reach_only_modules_of_the_key_by_their_own_names() -> None:
    # What compiled code refers to is followed at run time and compared with what the imports say
    reached = dependencies("model.simulation.kernel")
    for name in (m for m in reached if m.startswith("model.")):
        namespace = vars(__import__(name, fromlist=["_"]))
        of_ours = {getattr(value, "__module__", None) or "" for value in namespace.values()}
        assert {m for m in of_ours if m.startswith("model.")} <= set(reached), name
    folder = Path(model.__file__).parent
    for path in dependencies("model.simulation.kernel").values():
        if path.is_relative_to(folder) and path.name != "compilation.py":
            called = {
                ast.unparse(node.func) for node in ast.walk(ast.parse(path.read_bytes())) if isinstance(node, ast.Call)
            }
            assert not called & {"import_module", "importlib.import_module", "__import__", "setattr", "globals"}, path
    reached = dependencies("model.simulation.kernel")
    assert {"model.dynamics.recursive", "model.drives.amplifier", "model.layout"} <= set(reached)
    others = [m for m in reached if m.startswith(("model.reports", "model.fitting", "extras.thesis", "daq."))]
    assert set(others) == {"daq.contracts", "daq.contracts.file_lock"}, "the lock of the cache alone"


def test_machine_code_lies_in_the_folder_of_these_sources_and_no_path_decides() -> None:
    for function, module in ((kernel.run_closed_form, "kernel"), (recursive.forward_dynamics, "recursive")):
        assert function.py_func.__module__.endswith(module)
        assert Path(function.stats.cache_path).parent == cache_folder(function.py_func.__module__)
    assert cache_folder(kernel.__name__).name == source_hash(kernel.__name__)
    assert cache_folder(kernel.__name__) != cache_folder(recursive.__name__)
    assert cache_folder(kernel.__name__).parent == compilation._PARENT
    assert Path(kernel.run_closed_form.stats.cache_path).name == "model.simulation"
    assert SharedCacheLocator.get_suitable_cache_subpath("/a/user/s/own/effect.py").startswith("own_")


USES_ONE = """
import numpy
from model.drives.sensor import sensed_angle as function
function(1.0, numpy.ones(200))
print(sum(function.stats.cache_hits.values()), sum(function.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_another_clone_of_the_same_sources_compiles_nothing_again(tmp_path: Path) -> None:
    told = []
    for name in ("first", "second"):
        clone = tmp_path / name
        for package in ("model", "daq", "firmware_protocol"):
            shutil.copytree(compilation._ROOT / package, clone / package, ignore=shutil.ignore_patterns("__pycache__"))
        environment = os.environ | {"PYTHONPATH": str(clone), "NUMBA_CACHE_DIR": str(tmp_path / "compiled")}
        run = subprocess.run(
            [sys.executable, "-c", USES_ONE], cwd=clone, env=environment, capture_output=True, text=True, check=True
        )
        told.append(run.stdout.split())
    assert told == [["0", "1"], ["1", "0"]]


def test_one_process_compiles_while_others_wait_where_locks_work(monkeypatch: pytest.MonkeyPatch) -> None:
    with (cache_folder(recursive.__name__) / "lock").open("a") as another:
        with one_process_at_a_time(recursive.__name__), pytest.raises(BlockingIOError):
            fcntl.flock(another, fcntl.LOCK_EX | fcntl.LOCK_NB)
        fcntl.flock(another, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def refused(_file: object, _how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refused)
    with one_process_at_a_time(recursive.__name__), pytest.raises(ValueError, match="own"):
        raise ValueError("its own errors pass")


FULL = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))\n"
"""Every write to a file fails from here on, as on a full disk."""


@pytest.mark.parametrize(("first", "folder"), [("", "/proc/nonexistent"), (FULL, "full")], ids=["no folder", "full"])
def test_without_room_for_a_cache_it_computes_and_says_so_once(tmp_path: Path, first: str, folder: str) -> None:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / folder)}
    run = subprocess.run(
        [sys.executable, "-c", first + USES_ONE], env=environment, capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["0", "1"]
    (line,) = run.stderr.splitlines()
    assert line.startswith(f"Compiled code cannot be stored in {tmp_path / folder} (")
    assert "NUMBA_CACHE_DIR" in line


def test_only_old_caches_are_removed(tmp_path: Path) -> None:
    names = {"old": "0" * 16, "new": "1" * 16, "other": "not-ours"}
    for name in names.values():
        (tmp_path / name).mkdir()
    for name in ("old", "other"):
        os.utime(tmp_path / names[name], (0, 0))
    _remove_old(tmp_path, before=CACHE_DAYS * 86_400.0)
    assert sorted(p.name for p in tmp_path.iterdir()) == [names["new"], names["other"]]
