"""Lanes of jobs: a job of known, short duration does not wait behind one that iterates until it converges."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, get_args

from daq.contracts.service.jobs import CompareRequest, Job, JobRequest, ValidateRequest, WaitsBehind

Lane = Literal["short", "long"]
LANES: tuple[Lane, ...] = get_args(Lane)
SHORT_LANE_WORKERS = 1
"""Number of worker processes of the short lane. One is enough, since a job there takes seconds; each uses about 250
MB."""
MOST_PASSES = 20
"""Most passes over a trace in a short job; one takes about 1 s. A longer comparison takes as long as a fit."""


def lane_of(request: JobRequest) -> Lane:
    """Returns the lane of a job from its computation. Fits and diagnoses iterate and are always long."""
    match request:
        case CompareRequest():
            passes = len(request.traces) * len(request.models)
        case ValidateRequest():
            passes = len(request.traces)
        case _:
            return "long"
    return "short" if passes <= MOST_PASSES else "long"


def with_what_it_waits_for(job: Job, running: Iterable[Job], waiting: Sequence[Job]) -> Job:
    """Returns a queued job with the job before it in `waits_behind`.

    Args:
        running: running jobs of any lane
        waiting: queued jobs of any lane, in order of submission
    """
    lane = lane_of(job.request)
    computed = sorted((one for one in running if lane_of(one.request) == lane), key=lambda one: one.submitted)
    before = []
    for one in waiting:
        if one.id == job.id:
            break
        if lane_of(one.request) == lane:
            before.append(one)
    ahead = [*computed, *before]
    if not ahead:
        return job
    first = ahead[0]
    behind = WaitsBehind(job=first.id, request=first.request, started=first.started, others=len(ahead) - 1)
    return job.model_copy(update={"waits_behind": behind})
