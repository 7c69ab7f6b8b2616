"""Compares the robots' fits to the same experiment over time, from the results of their jobs.

It finds fitted values that have changed by more than their intervals allow.
"""

from __future__ import annotations

import json
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from math import hypot
from pathlib import Path
from statistics import NormalDist
from typing import Any

from daq.contracts.errors import DaqError
from daq.contracts.service.fleet import (
    ArmComparison,
    ArmFit,
    FittedNumber,
    FleetComparison,
    JointResidual,
    NumberChange,
)
from daq.contracts.service.jobs import Job, ParameterWords
from daq.contracts.service.traces import CatalogueEntry
from model.machine_model.model_file import model_of
from model.machine_model.parameter_words import words_by_name
from server.parts import Part
from server.problems import ProblemError
from server.services import Services
from server.store.jobs import traces_of

NORMAL_95 = NormalDist().inv_cdf(0.975)
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""
CHANCE = 0.05
"""Probability that noise alone makes any of the values that are compared together count as changed."""
Numbers = Mapping[str, FittedNumber]


@dataclass(frozen=True)
class Pair:
    """An earlier and a later fit of one robot, by the names of their parameters."""

    robot: str
    earlier: Numbers
    later: Numbers

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that both fits determine, in the same unit."""
        return tuple(
            name
            for name, after in self.later.items()
            if (before := self.earlier.get(name)) is not None and before.unit == after.unit
        )


def changes_of(pairs: tuple[Pair, ...]) -> dict[str, tuple[NumberChange, ...]]:
    """Returns the changes of all robots' values, by robot.

    All of them are judged together (Bonferroni): otherwise five of a hundred unchanged values would leave their 95 %
    interval.
    """
    count = sum(len(pair.names) for pair in pairs)
    limit = NormalDist().inv_cdf(1 - CHANCE / (2 * max(1, count)))
    return {pair.robot: tuple(_change(pair, name, limit) for name in pair.names) for pair in pairs}


def _change(pair: Pair, name: str, limit: float) -> NumberChange:
    before, after = pair.earlier[name], pair.later[name]
    difference, deviation = after.value - before.value, hypot(before.deviation, after.deviation)
    return NumberChange(
        name=name,
        unit=after.unit,
        before=before.value,
        after=after.value,
        difference=difference,
        low=difference - NORMAL_95 * deviation,
        high=difference + NORMAL_95 * deviation,
        changed=abs(difference) > limit * deviation,
    )


MOST_FITS = 100
"""Number of the newest fits of a robot that are compared."""
log = logging.getLogger("server.fleet")


@dataclass(frozen=True)
class Arm:
    """Access to one robot's data: the file of a job's result, and the catalogue's entry of a trace."""

    robot: str
    result: Callable[[str], Path]
    trace: Callable[[str], CatalogueEntry]


@dataclass(frozen=True)
class Kept:
    """A fit, its experiment, and its parameters in words."""

    fit: ArmFit
    experiment: str
    words: dict[str, ParameterWords]


class Comparisons(Part):
    """Caches the parsed results, since results never change and are large. Safe to use from any thread."""

    def __init__(self, services: Services) -> None:
        self._jobs = services.jobs
        self._kept: dict[str, Kept] = {}

    def compare(self, arms: Sequence[Arm], experiment: str | None, days: float) -> FleetComparison:
        """Compares the fits of these robots to one experiment; None for the one with the most fits.

        The newest fit of each robot is compared with its newest fit that is older by at least `days`.
        """
        fits = {arm.robot: self._fits(arm) for arm in arms}
        counted = Counter(kept.experiment for every in fits.values() for kept in every)
        chosen = experiment if experiment is not None else next((name for name, _ in counted.most_common(1)), None)
        own = {robot: [kept for kept in every if kept.experiment == chosen] for robot, every in fits.items()}
        series = {robot: sorted((kept.fit for kept in every), key=lambda fit: fit.at) for robot, every in own.items()}
        references = {robot: _reference(every, days) for robot, every in series.items()}
        pairs = tuple(
            Pair(robot, _numbers(before), _numbers(series[robot][-1]))
            for robot, before in references.items()
            if before is not None
        )
        changes = changes_of(pairs)
        return FleetComparison(
            experiments=tuple(sorted(counted)),
            experiment=chosen,
            days=days,
            robots=tuple(
                ArmComparison(
                    robot=robot,
                    fits=tuple(every),
                    reference=None if (before := references[robot]) is None else before.job,
                    changes=changes.get(robot, ()),
                )
                for robot, every in series.items()
            ),
            words={name: words for every in own.values() for kept in every for name, words in kept.words.items()},
        )

    def _fits(self, arm: Arm) -> list[Kept]:
        jobs = self._jobs.page(arm.robot, ("done",), "fit", None, MOST_FITS).items
        return [kept for job in jobs if (kept := self._kept_of(arm, job)) is not None]

    def _kept_of(self, arm: Arm, job: Job) -> Kept | None:
        if job.id not in self._kept:
            try:
                self._kept[job.id] = _read(arm, job)
            except (DaqError, ProblemError, OSError, ValueError, KeyError, TypeError) as error:
                log.warning("fit %s of %s is not compared: %s: %s", job.id, arm.robot, type(error).__name__, error)
        return self._kept.get(job.id)


def _read(arm: Arm, job: Job) -> Kept:
    """Reads a fit from the result of its job. Raises the errors of a missing or foreign file."""
    data = json.loads(arm.result(job.id).read_bytes())["data"]
    traces = [arm.trace(number) for number in traces_of(job.request)]
    fit = ArmFit(
        job=job.id,
        at=max(trace.created for trace in traces),
        traces=tuple(trace.id for trace in traces),
        converged=data["converged"],
        whitened_mean_square=data["whitened_mean_square"],
        residuals=tuple(_picked(JointResidual, one) for one in data["errors"]),
        numbers=tuple(_picked(FittedNumber, one) for one in data["parameters"] if one["deviation"] is not None),
    )
    words = words_by_name(model_of(data["model"], f"fit {job.id}").parameters)
    return Kept(fit, " + ".join(sorted({_name_of(trace) for trace in traces})), words)


def _picked(kind: Any, data: Mapping[str, Any]) -> Any:
    return kind(**{name: data[name] for name in kind.model_fields})


def _name_of(trace: CatalogueEntry) -> str:
    return trace.name or (trace.kind or "no experiment").replace("_", " ")


def _numbers(fit: ArmFit) -> dict[str, FittedNumber]:
    return {number.name: number for number in fit.numbers}


def _reference(fits: Sequence[ArmFit], days: float) -> ArmFit | None:
    """Returns the newest fit that is older than the last one by at least `days`."""
    older: Iterable[ArmFit] = (fit for fit in fits if fit.at <= fits[-1].at - timedelta(days=days) and fit != fits[-1])
    return max(older, key=lambda fit: fit.at, default=None)
