"""Experiments in the queue, and schedules that submit them."""

from __future__ import annotations

from typing import Annotated, Literal, Self, TypeVar

from pydantic import AwareDatetime, Field, StrictBool, model_validator

from daq.contracts.experiment import ExperimentSpec, InUnit
from daq.contracts.labels import Outcome
from daq.contracts.service.base import Moment, UserWire, Wire
from daq.contracts.service.queue import Reviewer
from daq.contracts.trace import EventKind

ExperimentState = Literal["queued", "running", "done", "failed", "cancelled", "interrupted"]
"""`done`: the plan was carried out completely. `failed`: refused, or ended by a safety check. `cancelled`: by a person,
before it began or by a stop. `interrupted`: the link, a process or the power failed; it is not run again
automatically."""

ENDS: frozenset[ExperimentState] = frozenset({"done", "failed", "cancelled", "interrupted"})
"""Final states of experiments and of jobs."""

ExperimentOrder = Literal["submitted", "ended"]
"""Order of a list: `submitted`, the newest first; `ended`, only ended experiments, the last ended first."""

Priority = Annotated[int, Field(ge=-100, le=100)]
"""Priority: the highest runs first; of equal ones, the one submitted first."""
Interval = Annotated[float, Field(ge=10, le=366 * 86400), InUnit("s")]
"""Time (s) between two runs of a schedule."""


Submission = TypeVar("Submission", "ExperimentRequest", "ScheduleRequest")
PresetName = Annotated[str, Field(min_length=1, max_length=64)]


class ExperimentRequest(UserWire):
    """An experiment to run, not before the time `at` (with its time zone); None for as soon as possible."""

    spec: ExperimentSpec = ExperimentSpec()
    preset: PresetName | None = None
    """Name of a preset, in place of `spec`."""
    at: Moment | None = None
    priority: Priority = 0

    @model_validator(mode="after")
    def _says_what_once(self) -> Self:
        _require_once(self)
        return self


class ExperimentPreset(Wire):
    """A named experiment with one line about its purpose."""

    name: str
    description: str
    spec: ExperimentSpec


class ExperimentChange(Wire):
    """Changes of a waiting experiment; fields that are None stay unchanged. A new specification ends its approval."""

    priority: Priority | None = None
    spec: ExperimentSpec | None = None

    @model_validator(mode="after")
    def _changes_something(self) -> Self:
        if self.priority is None and self.spec is None:
            raise ValueError("changes nothing; give `priority` or `spec`")
        return self


class Approval(Wire):
    """Who approved an experiment or a schedule, and when. `as_owner`: whether this person owned the robot."""

    by: str
    at: AwareDatetime
    as_owner: bool


class ApprovalRequest(Wire):
    """Approves exactly the `content` that the caller has seen in the experiment or schedule."""

    content: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Experiment(Wire):
    """One experiment with its state and outcome. `progress` is a fraction from 0 to 1, only while it runs."""

    id: str
    robot: str
    spec: ExperimentSpec
    state: ExperimentState
    priority: int
    at: AwareDatetime | None = None
    schedule: str | None = None
    """The schedule that submitted it."""
    submitted: AwareDatetime
    submitted_by: str
    owner: str = ""
    """Who may change and cancel it besides the robot's owners: the person who submitted it, or made its schedule. Empty
    from an older service."""
    changed_by: str | None = None
    """Who last changed its specification. This person, its owner and its submitter cannot approve it."""
    content: str = ""
    """While it waits: a digest of everything that an approval covers: the specification, the start time, the machine
    file and the limits."""
    approval: Approval | None = None
    needs_approval_of: Reviewer | None = None
    """Whose approval it still needs before it may begin; None if it needs none, or has been approved."""
    started: AwareDatetime | None = None
    ended: AwareDatetime | None = None
    progress: float | None = None
    progress_text: str = ""
    outcome: Outcome | None = None
    reason: str = ""
    """Why it was not completed, in one line."""
    trace: str | None = None
    """ID of its trace, once there is one."""


class ScheduleRequest(UserWire):
    """An experiment to repeat, for studies of wear and drift: at even intervals (`every`), or by the wall clock
    (`cron`)."""

    spec: ExperimentSpec = ExperimentSpec()
    preset: PresetName | None = None
    """Name of a preset, in place of `spec`."""
    every: Interval | None = None
    """Time (s) from one run to the next."""
    cron: Annotated[str, Field(max_length=100)] | None = None
    """When to run, as minute, hour, day, month and weekday of a cron table: `0 2 * * *` is daily at 02:00."""
    zone: Annotated[str, Field(pattern=r"^[A-Za-z0-9_+/-]{1,64}$")] | None = None
    """Time zone of `cron`, such as Europe/London; None for that of the service's computer."""
    starts: Moment | None = None
    """Time of the first run (with `cron`, its earliest time); None for now. Times in the past are skipped."""
    count: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Number of runs; None for no end."""
    priority: Priority = 0

    @model_validator(mode="after")
    def _says_when(self) -> Self:
        if (self.every is None) == (self.cron is None):
            raise ValueError("give either `every` or `cron`")
        if self.zone is not None and self.cron is None:
            raise ValueError("`zone` is for `cron`; leave it out")
        _require_once(self)
        return self


class ScheduleChange(Wire):
    """Switches a schedule on or off."""

    active: StrictBool


class Schedule(Wire):
    """A schedule and its progress. Runs that were due while the service was off, or while the previous run still
    waited, are skipped."""

    id: str
    robot: str
    spec: ExperimentSpec
    every: float | None
    """Time (s) from one run to the next; None with `cron`."""
    cron: str | None = None
    zone: str | None = None
    """Time zone of `cron`."""
    starts: AwareDatetime
    count: int | None
    priority: int
    active: bool
    submitted_runs: int
    rule: str = ""
    """Its times for people, such as `Tue-Sun at 02:00 (Europe/London)`."""
    next: AwareDatetime | None
    """When the next run is due; None if there is none."""
    last: AwareDatetime | None = None
    """When the last run is due; None if there is none, or more than 400 are left."""
    problem: str = ""
    """Why the service's computer cannot compute the next run, such as an unknown time zone; empty if it can."""
    created: AwareDatetime
    created_by: str
    content: str = ""
    """A digest of everything that an approval covers. An approval of the schedule applies to its runs."""
    approval: Approval | None = None
    needs_approval_of: Reviewer | None = None
    """Whose approval its runs still need; None if they need none, or have been approved."""


class MotionPreview(Wire):
    """The motion of an experiment, computed and checked without a robot. `set_points`: columns are the machine's
    joints, in rad. `violations`: the limits that it violates; empty if it may run."""

    time: tuple[float, ...]
    set_points: tuple[tuple[float, ...], ...]
    moving: tuple[int, ...]
    duration: float
    violations: tuple[MotionViolation, ...]
    marks: tuple[MotionMark, ...] = ()


class MotionViolation(Wire):
    """A limit that a motion violates: the worst point of one rule and joint (or link, for `floor` and `reach`). `time`
    in s from the start of the record; `value` and `limit` in rad, rad/s or m, for `posture` in posture units."""

    rule: Literal["finite", "posture", "range", "speed", "step", "floor", "reach"]
    joint: int
    time: float
    value: float | None
    limit: float | None
    message: str


class MotionMark(Wire):
    """The beginning or end of a part of the motion."""

    time: float
    kind: EventKind
    message: str


def _require_once(request: ExperimentRequest | ScheduleRequest) -> None:
    if request.preset is not None and "spec" in request.model_fields_set:
        raise ValueError("give either `spec` or `preset`, not both")


MotionPreview.model_rebuild()
