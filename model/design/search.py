"""Chooses D-optimal experiments: the set with the smallest ellipsoid of uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import FrozenRecord, UserRecord
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from model.arrays import Floats
from model.design.drawn_experiments import drawn_experiment
from model.design.information import (
    InformationGain,
    Planner,
    experiment_information,
    gain_of,
    log_det,
    prior_information,
)
from model.fitting.options import FitOptions
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model


class DesignOptions(UserRecord):
    """How to search: `experiments` of `duration` s each are chosen from `candidates` drawn with `seed`."""

    experiments: Annotated[int, Field(ge=1, le=50)] = 4
    duration: Annotated[float, Field(ge=1.0, le=600.0)] = 12.0
    candidates: Annotated[int, Field(ge=1, le=10_000)] = 60
    seed: Annotated[int, Field(ge=0)] = 0


class DesignedExperiments(FrozenRecord):
    """The chosen experiments, the most informative first, and their joint information.

    `nats[i]` is the information of the first i+1 experiments, beyond that of the priors. `refused` counts candidates
    outside the limits.
    """

    shown = ("nats", "considered", "refused")
    specs: tuple[ExperimentSpec, ...]
    gain: InformationGain
    nats: tuple[float, ...]
    refused: int
    considered: int
    options: DesignOptions


def design(
    model: Model,
    plan: Planner,
    options: DesignOptions | None = None,
    fit_options: FitOptions | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> DesignedExperiments:
    """Returns experiments within the limits that together determine the parameters of `fit_options` best.

    Greedy choice of the candidate that adds most to log det of the information (priors included), then exchanges as
    long as one helps (Fedorov 1972). The same seed gives the same experiments.

    Raises:
        SpecError: if no candidate is within the limits. CancelledError: when cancelled.
    """
    options, fit_options, cancel = options or DesignOptions(), fit_options or FitOptions(), cancel or Never()
    specs, informations, refused = [], [], 0
    unknowns: tuple[Unknown, ...] = ()
    last_refusal = ""
    for number in range(options.candidates):
        stop_if(cancel)
        count = options.candidates
        progress(0.95 * number / count, f"candidate {number + 1} of {count}, {refused} refused")
        spec = drawn_experiment(model.machine, number, options.duration, options.seed)
        try:
            unknowns, information = experiment_information(model, spec, plan, fit_options)
        except DaqError as error:
            refused, last_refusal = refused + 1, str(error)
            continue
        specs.append(spec)
        informations.append(information)
    if not specs:
        raise SpecError(f"none of {options.candidates} candidates can be carried out; the last: {last_refusal}")
    prior = prior_information(unknowns)
    chosen = best_set(prior, informations, options.experiments)
    totals = [prior + sum(informations[k] for k in chosen[: i + 1]) for i in range(len(chosen))]
    nats = tuple(log_det(total) - log_det(prior) for total in totals)
    progress(1.0, "done")
    return DesignedExperiments(
        specs=tuple(specs[k] for k in chosen),
        gain=gain_of(unknowns, prior, totals[-1]),
        nats=nats,
        refused=refused,
        considered=options.candidates,
        options=options,
    )


def best_set(prior: Floats, informations: Sequence[Floats], count: int) -> list[int]:
    """Returns indices of `count` different experiments (or all, if fewer) with the largest joint log det."""
    chosen: list[int] = []
    for _ in range(min(count, len(informations))):
        total = prior + sum(informations[k] for k in chosen)
        chosen.append(_best_addition(total, informations, chosen))
    improved = True
    while improved:
        improved = False
        for place in range(len(chosen)):
            others = [k for i, k in enumerate(chosen) if i != place]
            total = prior + sum(informations[k] for k in others)
            better = _best_addition(total, informations, others)
            if log_det(total + informations[better]) > log_det(total + informations[chosen[place]]) + 1e-9:
                chosen[place], improved = better, True
    return chosen


def _best_addition(total: Floats, informations: Sequence[Floats], taken: Sequence[int]) -> int:
    free = [k for k in range(len(informations)) if k not in taken]
    return max(free, key=lambda k: log_det(total + informations[k]))
