"""Computations in the background: fits, validations, comparisons, diagnoses; and the models they make."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire

JobKind = Literal["fit", "validate", "compare", "diagnose"]
JobState = Literal["queued", "running", "done", "failed", "cancelled", "interrupted"]


class Job(Wire):
    """One computation and what became of it. `progress` is a fraction from 0 to 1."""

    id: str
    robot: str
    kind: JobKind
    state: JobState
    traces: tuple[str, ...]
    models: tuple[str, ...]
    """The models that it takes."""
    submitted: AwareDatetime
    submitted_by: str
    started: AwareDatetime | None = None
    ended: AwareDatetime | None = None
    progress: float | None = None
    progress_text: str = ""
    reason: str = ""
    """Why it is not done, in one line."""
    model: str | None = None
    """The model that it made."""
