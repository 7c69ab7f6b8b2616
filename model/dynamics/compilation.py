"""Compiles the functions of the model, and decides where their machine code is stored.

numba checks cached code only against the source file of the function, not the files of the functions that it calls.
After an edit of the dynamics it would still run the old dynamics inside an unchanged simulation kernel. The machine
code of a function is therefore in a folder named by a hash of its module and of all our modules that it imports,
directly or not. An edit of any of them gives a new folder; an edit of a report does not. Compiled functions must import
their functions and constants, never look them up by name at run time. Since the hash identifies all sources, their
location does not matter: another clone finds the same machine code.
"""

from __future__ import annotations

import hashlib
import importlib
import multiprocessing
import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.util import resolve_name
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba.core import dispatcher as dispatchers
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator

from daq.contracts.file_lock import take_lock

CACHE_DAYS = 30
"""Time after which caches of older sources that are no longer written are removed."""

PACKAGES = ("model", "daq", "firmware_protocol")
"""Our packages that compiled code may import from. numba itself watches its own version and the processor."""

_ROOT = Path(__file__).resolve().parents[2]
_numba_settings: Any = numba.config


def _cache_folder() -> Path:
    """Returns the folder of compiled code: numba's own setting, or this user's; for a user without a home, one that
    cannot be written.
    """
    try:
        return Path(_numba_settings.CACHE_DIR or platformdirs.user_cache_path("ma2000-daq") / "compiled")
    except RuntimeError:
        return Path(os.devnull) / "compiled"


_PARENT = _cache_folder()


def dependencies(module: str, root: Path = _ROOT) -> dict[str, Path]:
    """Returns sources that a module of ours imports, directly or not, with itself and the packages around them, by
    name.

    Imports inside functions and for type checking count too. Empty for a module outside `root`.
    """
    found: dict[str, Path] = {}
    to_do = [module]
    while to_do:
        name = to_do.pop()
        path = None if name in found or name.partition(".")[0] not in PACKAGES else _source(name, root)
        if path is not None:
            found[name] = path
            to_do += [name.rpartition(".")[0], *_imports(name, path)]
    return found


def source_hash(module: str, root: Path = _ROOT) -> str:
    """Returns the hash of the sources that a module imports, names included, as 16 hexadecimal digits.

    For a module outside the project, such as a user's own: hash of its file, if it is imported, and of all of `model`.
    """
    sources = dependencies(module, root)
    if not sources:
        sources = {path.relative_to(root).as_posix(): path for path in root.joinpath("model").rglob("*.py")}
        own = getattr(sys.modules.get(module), "__file__", None)
        if own is not None:
            sources[module] = Path(own)
    digest = hashlib.sha256()
    for name, path in sorted(sources.items()):
        digest.update(name.encode() + b"\0")
        digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


@cache
def cache_folder(module: str) -> Path:
    """Returns the folder of the compiled code of a module; NUMBA_CACHE_DIR, if set, moves its parent.

    It may not exist if it cannot be created.
    """
    folder = _PARENT / source_hash(module)
    with suppress(OSError):
        if not folder.exists():
            folder.mkdir(parents=True, exist_ok=True)
            _remove_old(_PARENT, time.time() - CACHE_DAYS * 86_400)
    return folder


@contextmanager
def one_process_at_a_time(module: str) -> Iterator[None]:
    """While one process compiles a module's functions, others wait and then find them on disk.

    If the file system has no room for the lock or refuses it, each compiles by itself.
    """
    with ExitStack() as held:
        with suppress(OSError):
            lock = held.enter_context((cache_folder(module) / "lock").open("w", encoding="utf-8"))
            take_lock(lock, waits=True)
        yield


def _source(module: str, root: Path) -> Path | None:
    """Returns the file of a module or a package; None for a name inside a module."""
    path = root.joinpath(*module.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


_STATEMENT = re.compile(r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+)?import[ \t]+(?:\(([^)]*)\)|(.*))", re.MULTILINE)
"""An import as the formatter writes it. What only looks like one, in a text, adds a source at most."""
_ALIAS = re.compile(r"([\w.]+)(?:[ \t]+as[ \t]+\w+)?[ \t]*(?:,|#.*|$)", re.MULTILINE)


def _imports(module: str, path: Path) -> set[str]:
    """Names that a module may import: of `from a import b` both a and a.b, which is a module or something in one. To
    parse the sources would take as long as to load the compiled code."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    names = set()
    for origin, several, one in _STATEMENT.findall(path.read_text("utf-8")):
        aliases = _ALIAS.findall(several or one)
        whole = resolve_name(origin, package) if origin.startswith(".") else origin
        names |= {whole, *(f"{whole}.{alias}" for alias in aliases)} if origin else set(aliases)
    return names


def _remove_old(parent: Path, before: float) -> None:
    for sibling in parent.iterdir():
        looks_like_ours = len(sibling.name) == 16 and sibling.is_dir()
        if looks_like_ours and sibling.stat().st_mtime < before:
            shutil.rmtree(sibling, ignore_errors=True)


class SharedCacheLocator(UserProvidedCacheLocator):
    """Tells numba where to store machine code: for our sources by their place in the project, not on the disk."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        """Below the folder of the function's module."""
        self._py_file = py_file
        self._lineno = py_func.__code__.co_firstlineno
        self._cache_path = str(cache_folder(py_func.__module__) / self.get_suitable_cache_subpath(py_file))

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> SharedCacheLocator:
        """Accepts the folder also if it cannot be written: its content is read."""
        return cls(py_func, py_file)

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Folder below that of the module."""
        path = Path(py_file).resolve()
        if not path.is_relative_to(_ROOT):
            own: str = super().get_suitable_cache_subpath(py_file)  # type: ignore[no-untyped-call]
            return own
        return ".".join(path.relative_to(_ROOT).parts[:-1])

    def get_source_stamp(self) -> str:
        """Returns a stamp of the content of the function's file; older versions of numba use its time."""
        return hashlib.sha256(Path(self._py_file).read_bytes()).hexdigest()


class _SharedCacheFiles(CompileResultCacheImpl):
    _locator_classes = [SharedCacheLocator]  # numba declares this type


class SharedCache(FunctionCache):
    """A function's machine code on disk. If the disk refuses reading or writing, this process works without."""

    _impl_class = _SharedCacheFiles

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Returns compiled code for the signature; None if the disk has none."""
        with suppress(OSError):
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Stores compiled code; if that fails, one line on standard error says so for all functions."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            _tell_once(error.strerror or str(error))


@cache
def _tell_once(reason: str) -> None:
    """Reports that nothing is cached, only from the process that a person has started, not from its workers."""
    if multiprocessing.parent_process() is None:
        sys.stderr.write(
            f"Compiled code cannot be stored in {_PARENT} ({reason}): every start compiles it again (20 s). "
            "Set NUMBA_CACHE_DIR to a writable folder.\n"
        )


_numba_dispatchers: Any = dispatchers  # the class below has no types


class _Compiler(_numba_dispatchers._FunctionCompiler):  # type: ignore[misc]
    """Compiles no entry from Python where numbers have several parts (`wide_numbers`), which Python does not have."""

    _hidden = False

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        self._hidden = any("wide number" in str(kind) for kind in args)
        return super()._compile_core(args, return_type)

    def _customize_flags(self, flags: Any) -> Any:
        if self._hidden:
            flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        return flags


def _compile(function: Callable[..., Any], *, cached: bool, **options: Any) -> Any:
    """Compiles so that division by zero gives inf or nan, and a product may be fused with a sum, as in C with
    -march=native.

    Results thus repeat exactly on one machine, but not across machines.
    """
    dispatcher: Any = numba.njit(error_model="numpy", fastmath={"contract"}, **options)(function)
    if _numba_settings.DISABLE_JIT:
        return dispatcher
    dispatcher._compiler.__class__ = _Compiler
    if cached:
        dispatcher._cache = SharedCache(function)  # type: ignore[no-untyped-call]  # what its enable_caching does, with numba's own cache
    return dispatcher


def compiled(function: Callable[..., Any], *, nogil: bool = False) -> Any:
    """Compiles a module-level function that Python calls to machine code, cached on disk.

    With `nogil` other threads run beside it.
    """
    return _compile(function, cached=True, nogil=nogil)


def compiled_borrowing(function: Callable[..., Any]) -> Any:
    """Compiles, like `compiled`, a function that neither makes nor returns an array; see `borrowing`."""
    return _compile(function, cached=True, _nrt=False)


def internal(function: Callable[..., Any]) -> Any:
    """Compiles a function that only compiled code calls: without an entry from Python, and stored only within its
    callers.
    """
    return _compile(function, cached=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)


def borrowing(function: Callable[..., Any]) -> Any:
    """Compiles, like `internal`, a function that neither makes nor returns an array.

    It borrows its caller's arrays without counting references to them. Counting took longer than the arithmetic of a
    control period, which gets about twenty arrays. numba rejects one that makes an array after all.
    """
    return _compile(function, cached=False, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)


def inlined(function: Callable[..., Any]) -> Any:
    """Compiles a small scalar function that must be inlined into its caller."""
    return _compile(function, cached=False, forceinline=True)


def _import_without_looking_for_blas() -> None:
    """Prevents numba from importing scipy.linalg in search of a BLAS, which takes a fifth of the time of a first use.

    Nothing here needs one; a user's effect that multiplies matrices imports it automatically.
    """
    name = "scipy.linalg.cython_blas"
    if name in sys.modules:
        return
    sys.modules[name] = None  # type: ignore[assignment]  # the import system's way to say that there is none
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        del sys.modules[name]


_import_without_looking_for_blas()
