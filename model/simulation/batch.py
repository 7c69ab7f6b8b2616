"""Runs a batch of simulations of one model: chooses the compiled function and uses all cores."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numba.core.event import Listener, install_listener
from numpy.typing import NDArray

from model import layout as at
from model.arrays import Array
from model.dynamics.compilation import one_process_at_a_time
from model.dynamics.dual import DUAL_STEP
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.machine_model.parameter import Parameter
from model.simulation.period import OUTPUTS
from model.simulation.prepared import Prepared
from model.simulation.run_arrays import RecordArrays, RunArrays

CHUNKS_A_CORE = 4
"""Pieces per core into which a batch is cut. Runs differ in length; small pieces keep all cores busy to the end."""


@dataclass(frozen=True)
class BatchRun:
    """Runs of one model: run r uses `prepared[which[r]]`, row r of `vectors` and row r of `initials`.

    Args:
        vectors: (r, layout size) flat vectors, real or dual (complex128). initials: (r, n, 2), of the same kind.
        step: longest integration step, s.
        general: use the recursive dynamics even where there is a closed form.
    """

    model: Model
    prepared: Sequence[Prepared]
    which: NDArray[np.int64]
    vectors: Array
    initials: Array
    step: float
    general: bool = False

    def run(self, cores: int | None = None) -> Array:
        """Returns outputs (r, OUTPUTS, k, n) of all runs, in the order of `model.simulation.period`.

        k is that of the longest record; rows beyond the end of a shorter one are zero. Values are not finite where a
        run diverged. Threads share the work, because compiled code releases Python's lock. Results do not depend on
        `cores`.
        """
        compiled = _compiled_run(self.model, self.general)
        records, runs = self._records(), self._runs()
        out: Array = np.zeros((len(self.which), OUTPUTS, *records.set_points.shape[1:]), dtype=self.vectors.dtype)
        _make_ready(compiled, records, runs, out)
        cores = available_cores() if cores is None else cores
        if len(out) == 1 or cores == 1:
            compiled(0, len(out), records, runs, out)
            return out
        edges = np.unique(np.linspace(0, len(out), min(len(out), cores * CHUNKS_A_CORE) + 1).astype(np.int64))
        with ThreadPoolExecutor(cores) as pool:
            pieces = [pool.submit(compiled, int(a), int(b), records, runs, out) for a, b in pairwise(edges)]
        for piece in pieces:
            piece.result()
        return out

    def _records(self) -> RecordArrays:
        prepared = self.prepared
        return RecordArrays(
            lengths=np.array([len(p.set_points) for p in prepared]),
            set_points=_padded([p.set_points for p in prepared]),
            recorded=_padded([p.recorded for p in prepared]),
            noise=_padded([p.noise for p in prepared]),
            readings=_padded([p.readings for p in prepared]),
            following=np.array([p.following for p in prepared]),
            first_drive=np.array([p.first_drive for p in prepared]),
            gains=np.array([p.gains for p in prepared]),
            settings=np.array([p.settings for p in prepared]),
        )

    def _runs(self) -> RunArrays:
        from model.simulation.own_table import own_table  # imported here because numba's tools are slow to import

        shares = self.vectors[:, : at.SHARED].copy()
        shares[:, at.PERIOD] = np.array([p.period for p in self.prepared])[self.which]
        return RunArrays(
            which=self.which,
            initial=self.initials,
            shares=shares,
            parts=np.ascontiguousarray(self.vectors[:, at.SHARED :]).reshape(len(self.vectors), -1, at.PER_JOINT),
            flags=self.model.flags,
            own=own_table(self.model, self.vectors.dtype),
            step=self.step,
        )


def seed(parameter: Parameter, vector: Array, initial: Array) -> None:
    """Sets the parameter's dual part in the vector and initial state of a run that is differentiated by it."""
    vector[list(parameter.slots)] += 1j * DUAL_STEP
    if parameter.initial is not None:
        initial[parameter.initial] += 1j * DUAL_STEP


def available_cores() -> int:
    """Returns the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _compiled_run(model: Model, general: bool) -> Callable[..., None]:
    """Returns the closed form for the waist-shoulder-elbow arm of rods, else the recursive form."""
    from model.simulation import kernel  # imported here because it is slow to import

    if general or not is_rod_arm(model.machine):
        return kernel.run_chain
    flexible = bool((model.flags & (at.HAS_FLEXIBILITY | at.HAS_USER_EFFECT)).any())
    return kernel.run_flexible if flexible else kernel.run_closed_form


def _make_ready(compiled: Callable[..., None], records: RecordArrays, runs: RunArrays, out: Array) -> None:
    """Compiles a run for numbers of this kind, or loads it from disk, once for all threads and processes."""
    name = (compiled.__name__, out.dtype)
    if name not in _ready:
        announcement = install_listener("numba:compile", _Announcement(compiled))
        with one_process_at_a_time(compiled.__module__), announcement, _without_garbage_collection():
            compiled(0, 0, records, runs, out)  # empty range of runs
        _ready.add(name)


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Pauses garbage collection: the compiler's millions of objects live until it ends, and searching them takes a
    sixth of its time.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


_announced: list[str] = []
"""The compiled run that this process announces. Functions that it calls are compiled without a line."""
_ready: set[tuple[str, np.dtype[Any]]] = set()
"""Compiled runs, with their kind of numbers, that this process has compiled or loaded."""


class _Announcement(Listener):
    """Prints a line when a run is compiled; prints nothing when its machine code is found on disk."""

    def __init__(self, run: Callable[..., None]) -> None:
        self._run = run

    def on_start(self, event: Any) -> None:
        """Prints the line for the run itself, not for the functions that it calls."""
        if event.data["dispatcher"] is self._run and not _announced:
            _announced.append(self._run.__name__)
            sys.stderr.write("Compiling the simulation for this machine, once (about 20 s)\n")
            sys.stderr.flush()

    def on_end(self, event: Any) -> None:
        """Does nothing; numba requires the method."""


def _padded(arrays: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Stacks arrays (k, n) of different k into (t, longest, n)."""
    if len(arrays) == 1:
        return arrays[0][None]
    padded = np.zeros((len(arrays), max(len(a) for a in arrays), arrays[0].shape[1]))
    for row, array in zip(padded, arrays, strict=True):
        row[: len(array)] = array
    return padded
