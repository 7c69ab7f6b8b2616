"""What is taken from a file of another program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Choice:
    """What is taken from a recording of many things; it goes before the TOML beside it.

    topic:      of a bag, the topic with the joints; needed where several have some
    set_points: of a bag, the topic whose set points are taken beside those of `topic`
    joints:     names of the joints to take, in the order of the trace's joints; samples without them are left out
    received:   whether the times are those at which messages were received, in place of their own
    drive_unit: of the drive; `none` leaves the drive out
    map:        of a table, by signal: the columns and their unit (`daq.traces.mapping.expression`)
    where:      of a table, the rows to take: COLUMN=VALUE or COLUMN=LOW..HIGH
    as_guessed: whether columns are taken as their names let guess
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
