"""How every compiled function of the model is compiled, and where its machine code is kept.

numba decides whether cached code is still good by the source file of the function alone, not by the files of
the functions it calls: after an edit of the dynamics it would go on running the old dynamics inside an
unchanged simulation kernel. The cache is therefore kept in a folder named by a hash of all sources of the
model, so that any edit gives a fresh one.
"""

from __future__ import annotations

import hashlib
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import platformdirs

CACHE_DAYS = 30
"""Caches of older sources that have not been touched for this long are removed."""

_SOURCES = Path(__file__).resolve().parents[1]
_numba_settings: Any = numba.config
_PARENT = Path(_numba_settings.CACHE_DIR or platformdirs.user_cache_path("ma2000-daq") / "compiled")


def source_hash(folder: Path = _SOURCES) -> str:
    """Hash of every Python source below `folder`, names included, as 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled code of these very sources; NUMBA_CACHE_DIR, where set, moves its parent."""
    return _PARENT / source_hash()


def _use_cache_folder() -> None:
    folder = cache_folder()
    if not folder.exists():
        folder.mkdir(parents=True, exist_ok=True)
        _remove_old(_PARENT, time.time() - CACHE_DAYS * 86_400)
    _numba_settings.CACHE_DIR = str(folder)


def _remove_old(parent: Path, before: float) -> None:
    for sibling in parent.iterdir():
        looks_like_ours = len(sibling.name) == 16 and sibling.is_dir()
        if looks_like_ours and sibling.stat().st_mtime < before:
            shutil.rmtree(sibling, ignore_errors=True)


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a module-level function to machine code, cached on disk.

    Division by zero gives inf or nan instead of raising, and a product may be fused with a sum, as a C
    compiler does with -march=native: results repeat to the bit on one machine, not across machines.
    """
    return numba.njit(cache=True, error_model="numpy", fastmath={"contract"})(function)


def internal(function: Callable[..., Any]) -> Any:
    """As `compiled`, for functions that only compiled code calls: no entry from Python, so less to compile."""
    without_entry: Any = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # options its stubs do not list
    return numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, **without_entry)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """As `compiled`, for small scalar functions that must disappear into their caller."""
    return numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)(function)


_use_cache_folder()
