"""Runs a batch of simulations of one model: chooses the compiled function and uses all cores."""

from __future__ import annotations

import atexit
import gc
import math
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numba.core.event import Listener, install_listener
from numpy.typing import NDArray

from model import layout as at
from model.arrays import Floats
from model.dynamics.compilation import one_process_at_a_time
from model.dynamics.wide_numbers import PARTS, WIDTH, Dual, Lanes, Plain
from model.machine_model.model import Model
from model.machine_model.nominal import is_rod_arm
from model.machine_model.parameter import Parameter
from model.simulation.period import OUTPUTS
from model.simulation.prepared import Prepared
from model.simulation.run_arrays import RecordArrays, RunArrays

CHUNKS_A_CORE = 4
"""Pieces per core into which a batch is cut. Runs differ in length; small pieces keep all cores busy to the end."""
LARGEST_PIECE = 2**22
"""Most memory (bytes) for the outputs of a piece, so that large batches stay within the caches."""
LANES_FROM = 256
"""Least number of runs that go in lanes. Fewer are done before the compiled code for lanes is loaded."""
Direction = Parameter | Mapping[int, float]
"""What a derivative is taken by: a parameter, or changes of slots of the model's vector."""


@dataclass(frozen=True)
class BatchRun:
    """Runs of one model: run r uses `prepared[which[r]]`, row r of `vectors` and row r of `initials`.

    Many runs of the arm of rods with rigid transmissions go in lanes, `WIDTH` at once, if they share record and delays.
    All others go one by one. The motion is the same.

    Args:
        vectors: (r, layout size) flat vectors. initials: (r, n, 2).
        step: longest integration step, s.
        general: use the recursive dynamics even where there is a closed form.
        outputs: those that are returned, as numbered in `model.simulation.period`.
    """

    model: Model
    prepared: Sequence[Prepared]
    which: NDArray[np.int64]
    vectors: Floats
    initials: Floats
    step: float
    general: bool = False
    outputs: Sequence[int] = range(OUTPUTS)

    def run(self, cores: int | None = None) -> Floats:
        """Returns the outputs (r, outputs, k, n) of all runs.

        k is that of the longest record; rows beyond the end of a shorter one are zero. Values are not finite where a
        run diverged. Threads share the work, because compiled code releases Python's lock. Results do not depend on
        `cores`.
        """
        if len(self.which) >= LANES_FROM and self._compiled() is _kernel().run_closed_form:
            groups = self._groups()
            tag: Any = Lanes(0)
        else:
            groups, tag = np.arange(len(self.which))[:, None], Plain(0)
        found = np.zeros((len(self.which), *self._shape(len(self.outputs))))

        def arrays(own: slice) -> tuple[Floats, Floats]:
            rows = groups[own]
            if groups.shape[1] == 1:
                return self.vectors[rows[:, 0]], self.initials[rows[:, 0]]
            return _last(self.vectors[rows]), _last(self.initials[rows])

        def place(own: slice, out: Floats) -> None:
            found[groups[own]] = np.moveaxis(out, -1, 1) if groups.shape[1] > 1 else out[:, None]

        self._run(tag, self.which[groups[:, 0]], arrays, place, cores)
        return found

    def derivatives(self, by: Sequence[Sequence[Direction]], cores: int | None = None) -> list[tuple[Floats, Floats]]:
        """Returns for each run its outputs (outputs, k, n) and their derivatives (p, outputs, k, n) in p directions.

        by: parameters of the model or of the initial state, or changes of slots of the model's vector, for each run. A
        run in dual numbers carries `WIDTH`.
        """
        parts = [(r, own[i : i + WIDTH]) for r, own in enumerate(by) for i in range(0, max(1, len(own)), WIDTH)]
        runs = np.array([r for r, _ in parts])
        found = np.zeros((len(parts), *self._shape(len(self.outputs)), 1 + WIDTH))

        def arrays(own: slice) -> tuple[Floats, Floats]:
            vectors, initials = (
                np.concatenate([a[runs[own], ..., None], np.zeros((*a[runs[own]].shape, WIDTH))], axis=-1)
                for a in (self.vectors, self.initials)
            )
            for (_, parameters), vector, initial in zip(parts[own], vectors, initials, strict=True):
                for k, parameter in enumerate(parameters, 1):
                    seed(parameter, vector[:, k], initial[..., k])
            return vectors, initials

        def place(own: slice, out: Floats) -> None:
            found[own] = out

        self._run(Dual(0), self.which[runs], arrays, place, cores)
        slopes: list[list[Floats]] = [[] for _ in by]
        for (r, parameters), out in zip(parts, found, strict=True):
            slopes[r].append(np.moveaxis(out[..., 1 : 1 + len(parameters)], -1, 0))
        first = np.searchsorted(runs, np.arange(len(by)))
        return [(found[i, ..., 0], np.concatenate(own)) for i, own in zip(first, slopes, strict=True)]

    def _run(
        self,
        numbers: Any,
        which: NDArray[np.int64],
        arrays: Callable[[slice], tuple[Floats, Floats]],
        place: Callable[[slice, Floats], None],
        cores: int | None,
    ) -> None:
        """Runs in numbers of this kind, in pieces that fill the caches: threads take the next one when they are free.

        arrays: returns vectors and initial states of a piece. place: takes its outputs.
        """
        compiled, records, shape = self._compiled(), self._records(), self._shape(OUTPUTS)
        tail = (PARTS[type(numbers)],) if PARTS[type(numbers)] else ()
        own, every = own_table_of(self.model, numbers), tuple(self.outputs) == tuple(range(OUTPUTS))

        def piece(part: slice) -> None:
            vectors, initials = arrays(part)
            out = np.zeros((len(vectors), *shape, *tail))
            compiled(numbers, 0, len(out), records, self._runs(which[part], vectors, initials, own), out)
            place(part, out if every else out[:, list(self.outputs)])

        cores = available_cores() if cores is None else cores
        _make_ready(compiled, numbers, lambda: piece(slice(0, 0)))
        fitting = LARGEST_PIECE // (8 * math.prod((*shape, *tail)))
        share = -(-len(which) // (1 if cores == 1 else cores * CHUNKS_A_CORE))
        size = max(1, min(share, fitting))
        pieces = [slice(a, min(a + size, len(which))) for a in range(0, len(which), size)]
        if cores == 1 or len(pieces) == 1:
            for part in pieces:
                piece(part)
            return
        with ThreadPoolExecutor(cores) as pool:
            for done in [pool.submit(piece, part) for part in pieces]:
                done.result()

    def _groups(self) -> NDArray[np.int64]:
        """Returns the runs (g, WIDTH) of every group in lanes; the last run of a kind fills the rest of its group."""
        delays = [at.DELAY, *range(at.SHARED + at.EXTRA_DELAY, self.vectors.shape[1], at.PER_JOINT)]
        kinds = np.column_stack([self.which, self.vectors[:, delays]])
        _, kind = np.unique(kinds, axis=0, return_inverse=True)
        groups = []
        for k in range(kind.max() + 1):
            runs = np.flatnonzero(kind == k)
            groups.append(np.pad(runs, (0, -len(runs) % WIDTH), mode="edge").reshape(-1, WIDTH))
        return np.concatenate(groups)

    def _compiled(self) -> Callable[..., None]:
        """Returns the closed form for the waist-shoulder-elbow arm of rods, else the recursive form."""
        kernel = _kernel()
        if self.general or not is_rod_arm(self.model.machine):
            return kernel.run_chain
        flexible = bool((self.model.flags & (at.HAS_FLEXIBILITY | at.HAS_USER_EFFECT)).any())
        return kernel.run_flexible if flexible else kernel.run_closed_form

    def _shape(self, outputs: int) -> tuple[int, ...]:
        return outputs, max(len(p.set_points) for p in self.prepared), self.initials.shape[1]

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

    def _runs(self, which: NDArray[np.int64], vectors: Floats, initials: Floats, own: NDArray[np.int64]) -> RunArrays:
        """Packs runs in numbers of any kind: those of several parts have one dimension more."""
        shares, parts = vectors[:, : at.SHARED].copy(), np.ascontiguousarray(vectors[:, at.SHARED :])
        periods = np.array([p.period for p in self.prepared])[which]
        if vectors.shape[2:] == (PARTS[Dual],):
            shares[:, at.PERIOD, 0] = periods
        else:
            shares[:, at.PERIOD] = periods.reshape(-1, *([1] * (vectors.ndim - 2)))
        return RunArrays(
            which=which,
            initial=np.ascontiguousarray(initials),
            shares=shares,
            parts=parts.reshape(*initials.shape[:2], at.PER_JOINT, *vectors.shape[2:]),
            flags=self.model.flags,
            own=own,
            step=self.step,
        )


@cache
def _kernel() -> ModuleType:
    """Returns the compiled runs; imported here because they are slow to import."""
    with _without_garbage_collection():
        from model.simulation import kernel

    atexit.register(gc.freeze)  # or Python would search all of the compiler's objects before it ends
    return kernel


def own_table_of(model: Model, numbers: Any) -> NDArray[np.int64]:
    """Returns the table of users' effects for runs in numbers of this kind."""
    from model.simulation.own_table import own_table  # slow to import

    return own_table(model, np.complex128 if isinstance(numbers, Dual) else np.float64)


def _last(grouped: Floats) -> Floats:
    """Returns (g, WIDTH, …) as lanes, (g, …, WIDTH)."""
    return np.ascontiguousarray(np.moveaxis(grouped, 1, -1))


def seed(direction: Direction, vector: Floats, initial: Floats) -> None:
    """Sets the derivatives of the vector and initial state of a run in a direction: 1 in the places of a parameter."""
    if isinstance(direction, Mapping):
        vector[list(direction)] = list(direction.values())
        return
    vector[list(direction.slots)] = 1.0
    if direction.initial is not None:
        initial[direction.initial] = 1.0


def available_cores() -> int:
    """Returns the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _make_ready(compiled: Callable[..., None], numbers: Any, empty: Callable[[], None]) -> None:
    """Compiles a run for numbers of this kind, or loads it from disk, once for all threads and processes.

    empty: runs nothing.
    """
    name = (compiled.__name__, type(numbers))
    if name not in _ready:
        announcement = install_listener("numba:compile", _Announcement(compiled))
        with one_process_at_a_time(compiled.__module__), announcement, _without_garbage_collection():
            empty()
        _ready.add(name)


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Pauses garbage collection: the compiler's objects live until it ends, and searching them takes a sixth of the
    time of its import and its work.
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
_ready: set[tuple[str, type]] = set()
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
