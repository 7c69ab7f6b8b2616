"""Selects what to import from a file of another program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Choice:
    """Selects what to import from a recording; takes precedence over the TOML file beside the recording.

    topic:      in a bag, the topic with the joints; needed if several topics have some
    set_points: in a bag, the topic of the set points, if it is not `topic`
    joints:     names of the joints to import, in the order of the trace; samples without them are left out
    received:   whether to use the times at which messages were received instead of their own times
    drive_unit: unit of the drive; `none` leaves the drive out
    map:        in a table, the columns and their unit by signal (`daq.traces.mapping.expression`)
    where:      in a table, the rows to import: COLUMN=VALUE, COLUMN=LOW..HIGH or all
    as_guessed: whether to accept the columns that were guessed from their names
    numbering:  names of a machine's joints 1, 2 …, for a recording that names no machine
    """

    topic: str | None = None
    set_points: str | None = None
    joints: tuple[str, ...] | None = None
    received: bool = False
    drive_unit: str | None = None
    map: Mapping[str, str] = field(default_factory=dict)
    where: str | None = None
    as_guessed: bool = False
    numbering: tuple[str, ...] = ()
