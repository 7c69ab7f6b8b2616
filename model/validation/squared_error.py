"""Computes mean squared errors of many parameter sets against traces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import at_rows, simulate_many


@dataclass(frozen=True)
class SquaredError:
    """Mean squared position errors of a model with some parameters varied.

    The mean is over all samples of all traces, the sum over the joints `outputs` (4.70, section 7.2).
    """

    model: Model
    traces: tuple[Trace, ...]
    names: tuple[str, ...]
    outputs: tuple[int, ...]
    options: Options

    def by_joint(self, values: Floats) -> Floats:
        """Returns (m, len(outputs)) rad² for parameter values (m, p); inf where a run diverged."""
        inputs = [inputs_of(t, self.model.machine) for t in self.traces]
        sums, samples = np.zeros((len(values), len(self.outputs))), 0
        modelled = [self.model.machine.modelled_joints.index(j) for j in self.outputs]
        simulated = simulate_many(self.model, inputs, dict(zip(self.names, values.T, strict=True)), self.options)
        for trace, run, out in zip(self.traces, inputs, simulated, strict=True):
            readings = at_rows(np.moveaxis(out[:, 0][:, :, modelled], 1, 0), run.rows)
            measured = trace.position[:, [trace.column(j) for j in self.outputs]]
            with np.errstate(over="ignore", invalid="ignore"):
                sums += ((readings - measured[:, None, :]) ** 2).sum(axis=0)
            samples += len(trace)
        return np.where(np.isfinite(sums), sums / samples, np.inf)

    def total(self, values: Floats) -> Floats:
        """Returns (m,) rad², summed over the outputs."""
        return np.asarray(self.by_joint(values).sum(axis=1))


def squared_error(
    model: Model, traces: Sequence[Trace], names: Sequence[str], outputs: Sequence[int] | None, options: Options | None
) -> SquaredError:
    """Returns the error function of a model on traces; `outputs` selects joints, by default all modelled ones.

    Raises SpecError for an unknown parameter or joint, or no trace.
    """
    if not traces:
        raise SpecError("no trace: at least one is needed")
    for name in names:
        model.parameter(name)
    chosen = tuple(outputs) if outputs is not None else model.machine.modelled_joints
    for joint in chosen:
        if joint not in model.machine.modelled_joints:
            raise SpecError(
                f"output joint {joint}: not modelled; modelled joints are {list(model.machine.modelled_joints)}"
            )
    return SquaredError(model, tuple(traces), tuple(names), chosen, options or Options())
