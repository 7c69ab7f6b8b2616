"""A path recorded by hand guiding, and its playback."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import Annotated, Self

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from daq.contracts.errors import SpecError
from daq.contracts.experiment import JOINTS, ExperimentSpec, JointNumber, Path, Row
from daq.contracts.frozen import FrozenRecord
from daq.contracts.whole_file import replacing
from daq.traces import disk

SLOWEST_RATE = 0.01
"""Lowest playback rate: one minute of path then takes more than 1.5 hours."""
FASTEST_RATE = 10.0
"""Highest playback rate; usually the limits of the arm are lower."""


class RecordedPath(FrozenRecord):
    """Measured angles (rad), one row per control period, one column per joint; times (s) from the first row."""

    joints: Annotated[tuple[JointNumber, ...], Field(min_length=1, max_length=JOINTS)]
    times: Annotated[tuple[FiniteFloat, ...], Field(min_length=2, fail_fast=True)]
    positions: Annotated[tuple[Row, ...], Field(min_length=2, fail_fast=True)]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if list(self.joints) != sorted(set(self.joints)):
            raise ValueError(f"joints {list(self.joints)}: must be different and ascending")
        if len(self.times) != len(self.positions):
            raise ValueError(f"{len(self.times)} times for {len(self.positions)} rows of positions")
        if self.times[0] != 0 or any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise ValueError("times must start at 0 and increase strictly")
        if any(len(row) != len(self.joints) for row in self.positions):
            raise ValueError(f"every row of positions needs {len(self.joints)} angles")
        return self

    @property
    def duration(self) -> float:
        """Duration (s)."""
        return self.times[-1]

    def thinned(self, within: float) -> RecordedPath:
        """Returns the same path with as few points as keep it within `within` rad of every recorded one
        (Douglas–Peucker in time): points at rest and on straight lines are left out."""
        positions = np.array(self.positions)
        times = np.array(self.times)
        kept = {0, len(times) - 1}
        open_ends = [(0, len(times) - 1)]
        while open_ends:
            first, last = open_ends.pop()
            if last - first < 2:
                continue
            part = (times[first : last + 1] - times[first]) / (times[last] - times[first])
            line = positions[first] + part[:, None] * (positions[last] - positions[first])
            away = np.abs(positions[first : last + 1] - line).max(axis=1)
            worst = int(away.argmax())
            if away[worst] > within:
                kept.add(first + worst)
                open_ends += [(first, first + worst), (first + worst, last)]
        rows = sorted(kept)
        return RecordedPath(
            joints=self.joints,
            times=tuple(self.times[row] for row in rows),
            positions=tuple(self.positions[row] for row in rows),
        )


def playback(path: RecordedPath, rate: float = 1.0, name: str | None = None) -> ExperimentSpec:
    """Returns the experiment that plays a path at `rate` times the recorded speed: a slow move to its start, then the
    path.

    It is planned, checked, guarded and recorded like any experiment; the limit of 60 s does not apply. Raises SpecError
    for a rate outside SLOWEST_RATE to FASTEST_RATE.
    """
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise SpecError(f"rate of {rate}: allowed are {SLOWEST_RATE:g} to {FASTEST_RATE:g}")
    times = tuple(time / rate for time in path.times)
    return ExperimentSpec(trajectory=Path(times=times, positions=path.positions), joints=path.joints, name=name)


def save_path(path: RecordedPath, file: FilePath) -> None:
    """Writes a path as JSON, completely or not at all. Raises a one-line SpecError."""
    write_whole(file, path.model_dump_json(indent=1) + "\n")


def write_whole(path: FilePath, text: str) -> None:
    """Writes a text file and syncs it to the disk. Raises a one-line SpecError; the old file then stays."""
    try:
        with replacing(path) as part:
            part.write_bytes(text.encode())
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {disk.reason(error)}") from error
