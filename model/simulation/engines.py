"""Which compiled run a model needs, and calling it with one or many parameter sets on all cores."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numba.core.event import Listener, install_listener
from numpy.typing import NDArray

from daq.contracts.machine import Cylinder, Machine, Rod
from model.dynamics.compilation import one_process_at_a_time
from model.machine_model import layout as at
from model.machine_model.model import Model

if TYPE_CHECKING:
    from model.simulation.simulate import Prepared

CHUNKS_A_CORE = 4
"""Pieces of a batch a core: even where runs differ in length."""


@dataclass(frozen=True)
class Engine:
    """A compiled run of a model. `published_loads`: load-dependent friction by (7.32) to (7.34)."""

    model: Model
    batch: Callable[..., None]
    published_loads: bool

    def run(
        self, prepared: Sequence[Prepared], which: NDArray[np.int64], vectors: NDArray[Any], initials: NDArray[Any],
        flags: NDArray[np.int64], step: float, out: NDArray[Any], cores: int | None = None,
    ) -> None:  # fmt: skip
        """Runs into `out` (r, OUTPUTS, k, n): run r takes `prepared[which[r]]`, row r of `vectors` and `initials`.

        Threads share the work; the compiled code holds no lock of Python's. Results do not depend on their number.
        """
        from model.simulation.own_table import own_table

        shares = vectors[:, : at.SHARED].copy()
        shares[:, at.PERIOD] = np.array([p.period for p in prepared])[which]
        parts = np.ascontiguousarray(vectors[:, at.SHARED :]).reshape(len(vectors), -1, at.PER_JOINT)
        arguments = (
            which, np.array([len(p.set_points) for p in prepared]), _padded([p.set_points for p in prepared]),
            _padded([p.recorded for p in prepared]), _padded([p.noise for p in prepared]),
            _padded([p.readings for p in prepared]), np.array([p.following for p in prepared]), initials,
            np.array([p.first_drive for p in prepared]), shares, parts, np.array([p.gains for p in prepared]), flags,
            np.array([p.settings for p in prepared]), own_table(self.model, vectors.dtype), step, out,
        )  # fmt: skip
        cores = available_cores() if cores is None else cores
        alone = len(which) == 1 or cores == 1
        self._make_ready(arguments, vectors.dtype)
        if alone:
            self.batch(0, len(which), *arguments)
            return
        edges = np.unique(np.linspace(0, len(which), min(len(which), cores * CHUNKS_A_CORE) + 1).astype(np.int64))
        with ThreadPoolExecutor(cores) as pool:
            pieces = [pool.submit(self.batch, int(a), int(b), *arguments) for a, b in pairwise(edges)]
        for piece in pieces:
            piece.result()

    def _make_ready(self, arguments: tuple[Any, ...], numbers: np.dtype[Any]) -> None:
        """Compiles the run for numbers of this kind, or loads it from disk: once, not in every thread and process."""
        name = (self.batch.__name__, numbers)
        if name not in _ready:
            with (
                one_process_at_a_time(self.batch.__module__),
                install_listener("numba:compile", _Announcement(self.batch)),
            ):
                self.batch(0, 0, *arguments)  # no run
            _ready.add(name)


_announced: list[str] = []
"""The run whose compilation this process has told of: other runs and other kinds of numbers follow without a line."""
_ready: set[tuple[str, np.dtype[Any]]] = set()
"""Runs that this process has compiled or loaded."""


class _Announcement(Listener):
    """Says that a run is being compiled, and nothing where its machine code is found on disk."""

    def __init__(self, run: Callable[..., None]) -> None:
        self._run = run

    def on_start(self, event: Any) -> None:
        """A line when the run itself is compiled, none for what it calls."""
        if event.data["dispatcher"] is self._run and not _announced:
            _announced.append(self._run.__name__)
            sys.stderr.write("Compiling the simulation for this machine, once: some 20 s\n")
            sys.stderr.flush()

    def on_end(self, event: Any) -> None:
        """Nothing to say."""


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def engine_for(model: Model, *, general: bool = False) -> Engine:
    """The engine of a model: the closed form where the machine is the waist-shoulder-elbow arm of rods.

    `general` takes the recursive form even there, to compare the two.
    """
    from model.simulation import kernel

    rods = is_rod_arm(model.machine)
    if general or not rods:
        return Engine(model, kernel.run_chain, published_loads=rods)
    flexible = bool((model.flags & (at.HAS_FLEXIBILITY | at.HAS_USER_EFFECT)).any())
    return Engine(model, kernel.run_flexible if flexible else kernel.run_closed_form, published_loads=True)


def is_rod_arm(machine: Machine) -> bool:
    """Whether the closed form and (7.32) to (7.34) describe this machine."""
    joints = [machine.joint(j) for j in machine.modelled_joints]
    if len(joints) != 3 or any(j.kind != "revolute" for j in joints):
        return False
    right_angle = math.isclose(joints[0].geometry.alpha.value, math.pi / 2, abs_tol=1e-12)
    shapes = isinstance(joints[0].link, Cylinder) and all(isinstance(j.link, Rod) for j in joints[1:])
    return right_angle and joints[1].geometry.alpha.value == 0.0 and joints[0].geometry.a.value == 0.0 and shapes


def _padded(arrays: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Arrays (k, n) of different k as one (t, longest, n)."""
    if len(arrays) == 1:
        return arrays[0][None]
    padded = np.zeros((len(arrays), max(len(a) for a in arrays), arrays[0].shape[1]))
    for row, array in zip(padded, arrays, strict=True):
        row[: len(array)] = array
    return padded
