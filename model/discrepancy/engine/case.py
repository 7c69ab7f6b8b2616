"""A case: the records of a diagnosis, fitted and held out, and what only their kind of comparison knows of them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import Candidate, RemainingShape, Step, Where
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import Fit, evaluate, fit
from model.discrepancy.engine.priors import prior_distance
from model.discrepancy.engine.probing import Probe, Projection, Start, Trial
from model.discrepancy.engine.residual import Residual, Signals, Values
from model.discrepancy.grounds import Method
from model.discrepancy.options import TorqueOptions
from model.discrepancy.verdict import Errors
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF


def expected_values(now: Fit) -> dict[str, float]:
    """The values of a fit, with all numbers of which something is expected at that."""
    return {**now.values, **{u.name: u.expected for u in now.unknowns if u.deviation is not None}}


def far_off(now: Fit) -> list[Unknown]:
    """Numbers far from what is expected of them: what is missing has driven them off."""
    return [u for u in now.unknowns if abs(prior_distance(u, now.values[u.name])[0]) > FAR_OFF]


def is_strained(now: Fit) -> bool:
    """Whether there is such a number."""
    return bool(far_off(now))


Watch = Callable[[tuple[Candidate, ...]], None]
"""Called with the leading candidates of a step, the best first, whenever one of them has been computed."""


@dataclass(frozen=True, eq=False)
class Case(ABC):
    """The records of a diagnosis. There are two kinds: torques along the motion, readings of the closed loop.

    given: the model as the user gave it. compared, held_out: the model with the fitted records, and with those that are
    not; None where there are none. noise, noise_held: (n,) standard deviations of residuals there of which only noise
    is left. names: identities of all traces.
    """

    given: Model
    compared: Residual
    held_out: Residual | None
    noise: Floats
    noise_held: Floats
    options: TorqueOptions
    names: tuple[str, ...] = ()
    watch: Watch | None = None
    _held: dict[tuple[int, bytes], tuple[Model, Signals]] = field(default_factory=dict, init=False, repr=False)

    method: ClassVar[Method]
    measure: ClassVar[Literal["closed-loop", "torques"]]
    noise_error: ClassVar[float]
    """Share by which the noise of a residual may be larger than `noise`."""
    law_error: ClassVar[float]
    """Share of what an effect explains that is explained by its law alone being not exactly the machine's."""

    @abstractmethod
    def unknowns(self, model: Model, added: Mapping[str, Parameter]) -> tuple[Unknown, ...]:
        """Numbers that may be a little wrong on a healthy machine, and those that were `added`, without priors."""

    @abstractmethod
    def first(self, unknowns: Sequence[Unknown]) -> Fit:
        """The model as it was given, with its numbers fitted."""

    @abstractmethod
    def trials(self, clear: Projection, probed: Sequence[Probe]) -> Iterable[Trial]:
        """Effects that the model of a fit lacks, and numbers that the file may state wrongly.

        probed: the trials so far; it grows while they are asked for.
        """

    @abstractmethod
    def least_gain(self, trial: Trial, needed: float) -> float:
        """What a probe must promise for its trial to be fitted, where so much evidence is needed."""

    @abstractmethod
    def is_resolved(self, found: Fitted, before: Fit) -> bool:
        """Whether the records can tell an effect, as it was fitted, from a healthy machine.

        Args:
            before: the fit without it.
        """

    @property
    @abstractmethod
    def unresolved_kind(self) -> frozenset[str]:
        """Effects that stand beside one another even where the records do not resolve them."""

    @abstractmethod
    def where(self, now: Fit) -> Where:
        """Where a model disagrees with the fitted records."""

    @abstractmethod
    def shapes(self, now: Fit) -> tuple[RemainingShape, ...]:
        """What is left, as a torque that a person could write an effect after."""

    def noise_beside(self, now: Fit) -> Floats:  # noqa: ARG002 (the same, if not said)
        """(n,) standard deviation of a residual of the fitted records of which only noise is left, beside a model."""
        return self.noise

    @abstractmethod
    def joints_left(self, now: Fit, first: Fit, *, named: bool) -> tuple[int, ...]:
        """Joints on which more is left than noise, and is no noise."""

    def wrong_on(self, step: Step, left: Sequence[int]) -> tuple[int, ...]:  # noqa: ARG002 (none, if not said)
        """Joints of those with something `left` on which the effect of a step only resembles what is missing."""
        return ()

    @abstractmethod
    def unit(self, joint: int) -> str:
        """Of a residual."""

    @abstractmethod
    def errors(self, now: Fit) -> Errors:
        """Errors of every joint, as the gap between model and records is shown."""

    @abstractmethod
    def noise_of_errors(self, now: Fit) -> tuple[Floats, Floats]:
        """(n,) what noise leaves of such errors of the fitted records, and (n,) how much it may leave at most."""

    @abstractmethod
    def bias(self, now: Fit, parameters: Sequence[Parameter]) -> dict[str, float]:
        """How far estimates may be off beside what noise does, by name."""

    @abstractmethod
    def kept(self, now: Fit, wider: Model) -> Iterable[Unknown]:
        """The unknowns of a fit that a model with a further effect has as well."""

    @abstractmethod
    def take_back(self, effect: str, own: Sequence[Parameter], now: Fit) -> Start:
        """Values with which an effect has taken over what a fit has made of stated numbers, as stated again."""

    def where_expected(self, now: Fit) -> Fit:
        """The model of a fit where the file states its numbers."""
        return evaluate(now.compared, now.unknowns, expected_values(now), now.memory)

    def from_expected(
        self, compared: Residual, unknowns: Sequence[Unknown], begin: Values, memory: Floats, goal: float = math.inf
    ) -> Fit:
        """A fit that begins where the file states its numbers, far from where they are."""
        return fit(compared, unknowns, begin, memory, goal=goal)

    def or_from_expected(self, ended: Fit, goal: float = math.inf) -> Fit:
        """The fit; if it has left numbers far from what the file states, a better one that begins with them as
        stated."""
        if not is_strained(ended):
            return ended
        again = self.from_expected(ended.compared, ended.unknowns, expected_values(ended), ended.memory, goal)
        return min(ended, again, key=lambda one: one.cost)

    def or_across(self, ended: Fit, goal: float = math.inf) -> Fit:  # noqa: ARG002 (none, if not said)
        """The fit, or a better one from across a ridge of its cost, where the case knows of one."""
        return ended

    def held(self, now: Fit) -> Signals:
        """What a fitted model leaves of the held-out records; empty where there are none."""
        if self.held_out is None:
            return ()
        key = id(now.model), np.array(list(now.values.values())).tobytes()
        if key not in self._held:
            left = self.held_out.of_model(now.model).at(now.values)
            self._held[key] = now.model, left  # the model is kept, so that its identity stays its own
        return self._held[key][1]

    def held_squares(self, now: Fit) -> Floats:
        """(n,) mean squares of that."""
        assert self.held_out is not None
        return self.held_out.samples.mean_squares(self.held(now))
