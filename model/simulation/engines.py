"""Which compiled run a model needs, and calling it with one or many parameter sets."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import Cylinder, Machine, Rod
from model.machine_model.model import Model

if TYPE_CHECKING:
    from model.simulation.simulate import Prepared


@dataclass(frozen=True)
class Engine:
    """A compiled run. `published_loads`: load-dependent friction by (7.32) to (7.34)."""

    single: Callable[..., None]
    many: Callable[..., None]
    published_loads: bool

    def run(
        self, prepared: Prepared, vector: NDArray[Any], initial: NDArray[Any], flags: NDArray[np.int64], step: float,
        out: NDArray[Any],
    ) -> None:  # fmt: skip
        """One run into `out` (OUTPUTS, k, n)."""
        self.single(
            prepared.set_points, prepared.recorded, prepared.noise, initial, prepared.first_drive, vector,
            prepared.gains, flags, prepared.settings, step, out,
        )  # fmt: skip

    def run_many(
        self, prepared: Sequence[Prepared], which: NDArray[np.int64], vectors: NDArray[Any], initials: NDArray[Any],
        flags: NDArray[np.int64], step: float, out: NDArray[Any],
    ) -> None:  # fmt: skip
        """Runs on all cores: run r takes `prepared[which[r]]`, row r of `vectors` and `initials`."""
        lengths = np.array([len(p.set_points) for p in prepared])
        self.many(
            _padded([p.set_points for p in prepared]), _padded([p.recorded for p in prepared]),
            _padded([p.noise for p in prepared]), initials, np.array([p.first_drive for p in prepared]), lengths, which,
            vectors, np.array([p.gains for p in prepared]), flags, np.array([p.settings for p in prepared]), step, out,
        )  # fmt: skip


def engine_for(model: Model) -> Engine:
    """The engine of a model: the closed form where the machine is the waist-shoulder-elbow arm of rods."""
    from model.simulation.kernel import many_closed_form, run_closed_form

    return Engine(run_closed_form, many_closed_form, published_loads=True)


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
    padded = np.zeros((len(arrays), max(len(a) for a in arrays), arrays[0].shape[1]))
    for row, array in zip(padded, arrays, strict=True):
        row[: len(array)] = array
    return padded
