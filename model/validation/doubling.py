"""Finds the changes of single parameters that double an error: 2p root searches in lockstep, to run in batches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import at_rows, simulate_many

Errors = Callable[[Floats], Floats]
"""Mean squared errors (m,) of parameter sets (m, p); NaN or inf where a run diverged."""

GROWTH = 2.0
"""Factor by which a search widens until the error has doubled."""
TOLERANCE = 1e-3
"""Relative accuracy of a doubling change."""
LONGEST_SEARCH = 60
"""Most rounds of a search, including those that widen it."""


@dataclass
class Search:
    """Search for one parameter in one direction; changes are magnitudes.

    `inside` is the largest change known not to double the error, `outside` the smallest known to double it. Their
    levels are √(E/E₀ − 1) − 1, which is linear in the change where E is a parabola. `slope` is E/E₀ near zero change.
    """

    parameter: int
    sign: int
    limit: float
    trial: float
    inside: float = 0.0
    outside: float | None = None
    inside_level: float = -1.0
    outside_level: float = math.inf
    lowest: float = 1.0
    done: bool = False
    last_sides: list[bool] = field(default_factory=list)

    @property
    def change(self) -> float | None:
        """Returns the change that doubles the error; None if none within the limit does."""
        return self.outside

    def take(self, ratio: float) -> None:
        """Processes the error ratio E/E₀ at `trial`, and chooses the next trial."""
        level = math.inf if not math.isfinite(ratio) else math.copysign(math.sqrt(abs(ratio - 1)), ratio - 1) - 1
        if math.isfinite(ratio):
            self.lowest = min(self.lowest, ratio)
        beyond = level >= 0
        if beyond:
            self.outside, self.outside_level = self.trial, level
        else:
            self.inside, self.inside_level = self.trial, level
        self.last_sides.append(beyond)
        if self.outside is None:
            self.done = self.trial >= self.limit
            self.trial = min(self.limit, GROWTH * self.trial)
            return
        self.done = self.outside - self.inside <= TOLERANCE * self.outside
        self.trial = self._between()

    def _between(self) -> float:
        """Returns the next trial: by false position, or the middle after the same end has moved twice."""
        assert self.outside is not None
        width = self.outside - self.inside
        stuck = len(self.last_sides) >= 2 and self.last_sides[-1] == self.last_sides[-2]
        if stuck or not math.isfinite(self.outside_level):
            self.last_sides.clear()
            return self.inside + 0.5 * width
        share = -self.inside_level / (self.outside_level - self.inside_level)
        # slightly beyond the estimate, so that the bracket closes from both ends
        share += 0.25 * TOLERANCE * (1 if self.outside_level > -self.inside_level else -1)
        return self.inside + width * min(0.999, max(0.001, share))


@dataclass(frozen=True)
class Doubling:
    """Changes (magnitudes) that double the error, downwards and upwards; None if no change within the bounds does.

    `lowest` is the smallest E/E₀ found on the way. Clearly below one, it shows that the starting point was no minimum.
    """

    down: float | None
    up: float | None
    lowest: float

    @property
    def mean(self) -> float | None:
        """α_d: the mean of both changes (4.63), or the only one, or None."""
        known = [c for c in (self.down, self.up) if c is not None]
        return sum(known) / len(known) if known else None


def doubling_changes(
    errors: Errors,
    best: Floats,
    low: Floats,
    high: Floats,
    first: Floats,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> tuple[float, list[Doubling]]:
    """Returns the error at `best`, and for each of its p parameters the changes that double it.

    Args:
        errors: of many parameter sets at once.
        best: (p,) the fitted parameters. low, high: (p,) finite bounds for the changed values.
        first: (p,) positive first changes; any size works, but a good guess saves runs.

    Raises:
        SpecError: for bounds that exclude `best`, or an error there that is not positive and finite.
        CancelledError: when cancelled.
    """
    cancel = cancel or Never()
    if not ((low <= best) & (best <= high) & np.isfinite(low) & np.isfinite(high)).all():
        raise SpecError("the parameters must lie within finite bounds")
    least = float(errors(best[None])[0])
    if not (math.isfinite(least) and least > 0):
        raise SpecError(f"the model's mean squared error is {least}; a positive number is needed to double it")
    searches = [
        Search(p, sign, room, min(float(first[p]), room))
        for p in range(len(best))
        for sign, room in ((-1, float(best[p] - low[p])), (1, float(high[p] - best[p])))
        if room > 0
    ]
    for round_ in range(LONGEST_SEARCH):
        open_ = [s for s in searches if not s.done]
        if not open_:
            break
        stop_if(cancel)
        progress(1 - len(open_) / len(searches), f"doubling the error: round {round_ + 1}, {len(open_)} searches open")
        points = np.tile(best, (len(open_), 1))
        for row, search in zip(points, open_, strict=True):
            row[search.parameter] += search.sign * search.trial
        for search, error in zip(open_, errors(points), strict=True):
            search.take(float(error) / least)
    progress(1.0, "doubling the error: done")
    return least, [_doubling([s for s in searches if s.parameter == p]) for p in range(len(best))]


def _doubling(searches: list[Search]) -> Doubling:
    sides = {s.sign: s.change for s in searches}
    return Doubling(sides.get(-1), sides.get(1), min((s.lowest for s in searches), default=1.0))


# --- Computes mean squared errors of many parameter sets against traces


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
