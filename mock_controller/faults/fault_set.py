"""The active faults, their times, and counts of their actions."""

from __future__ import annotations

import math
import random
import zlib
from collections import Counter
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from mock_controller.faults.fault import Chunk, Direction, Fault, FaultError, FaultyParts, PartFault, WireFault
from mock_controller.faults.parts import Stall
from mock_controller.faults.registry import describe, parse_fault


@dataclass
class ActiveFault:
    """One fault that has been switched on: its span in board time (µs) and its own random numbers."""

    label: str
    fault: Fault
    dice: random.Random
    begin_us: int
    end_us: float
    begun: bool = False

    def covers(self, time_us: int) -> bool:
        """Whether the fault acts at a time."""
        return self.begin_us <= time_us < self.end_us


@dataclass
class FaultSet:
    """All faults of one mock. Repeatable: each draws from its own seeded numbers, once per frame or period."""

    parts: FaultyParts
    seed: int = 0
    active: list[ActiveFault] = field(default_factory=list)
    injected: Counter[tuple[str, str]] = field(default_factory=Counter)
    """How often each fault has acted, by its name and by direction (`board` if it has none)."""

    def switch_on(self, text: str) -> ActiveFault:
        """Adds the fault of `name:parameter=value,…`, from now on. Raises FaultError."""
        fault = parse_fault(text)
        now = self.parts.board.time_us
        label = self._free_label(fault.name)
        seed = fault.seed if fault.seed >= 0 else (self.seed << 32) + zlib.crc32(label.encode())
        begin = now + round(1e6 * fault.start)
        end = begin + (math.inf if fault.duration == math.inf else round(1e6 * fault.duration))
        entry = ActiveFault(label, fault, random.Random(seed), begin, end)
        self.active.append(entry)
        self.make_changes(now)
        return entry

    def switch_off(self, name: str) -> list[str]:
        """Ends the fault with this label, or all with this name; returns their labels. Raises FaultError."""
        ended = [entry for entry in self.active if name in (entry.label, entry.fault.name)]
        if not ended:
            on = ", ".join(entry.label for entry in self.active) or "none"
            raise FaultError(f"fault {name!r}: is not switched on; switched on are: {on}")
        for entry in ended:
            self._end(entry)
        return [entry.label for entry in ended]

    def listing(self) -> list[dict[str, Any]]:
        """Returns the active faults, as JSON data."""
        now = self.parts.board.time_us
        return [{"label": entry.label, "acting": entry.covers(now), **describe(entry.fault)} for entry in self.active]

    def counts(self) -> dict[str, dict[str, int]]:
        """Returns how often each fault has acted, by name, then by direction."""
        result: dict[str, dict[str, int]] = {}
        for (name, where), count in sorted(self.injected.items()):
            result.setdefault(name, {})[where] = count
        return result

    # --- time

    def next_change_us(self) -> int | None:
        """Returns the time at which the next fault begins or ends; None if there is none."""
        times = [entry.end_us if entry.begun else entry.begin_us for entry in self.active]
        due = min(times, default=math.inf)
        return None if due == math.inf else int(due)

    def make_changes(self, now: int) -> None:
        """Starts and ends the faults that are due at a time (µs)."""
        for entry in list(self.active):
            if not entry.begun and entry.begin_us <= now:
                entry.begun = True
                if isinstance(entry.fault, PartFault):
                    entry.fault.begin(self.parts, entry.dice, self._counter(entry))
            if entry.begun and entry.end_us <= now:
                self._end(entry)

    def before_period(self, begins_us: int) -> None:
        """Acts before a control period that begins at this time (µs)."""
        self.make_changes(begins_us)
        for entry in self.active:
            if entry.begun and isinstance(entry.fault, PartFault):
                entry.fault.each_period(self.parts, entry.dice, self._counter(entry))

    # --- the line

    def on_the_wire(self, data: bytes, direction: Direction) -> list[Chunk]:
        """Returns the chunks into which one encoded frame is changed now: all faults of the line act in the order of
        switching on."""
        chunks = [Chunk(data)]
        if not self.active:
            return chunks
        now = self.parts.board.time_us
        for entry in self.active:
            if not entry.covers(now):
                continue
            fault = entry.fault
            if isinstance(fault, Stall):
                self.injected[fault.name, direction] += 1
                silent_us = int(entry.end_us) - now
                chunks = [Chunk(chunk.data, max(chunk.delay_us, silent_us)) for chunk in chunks]
            elif isinstance(fault, WireFault) and fault.direction in ("both", direction):
                chunks = [part for chunk in chunks for part in self._struck(entry, fault, chunk, direction)]
        return chunks

    def _struck(self, entry: ActiveFault, fault: WireFault, chunk: Chunk, direction: Direction) -> list[Chunk]:
        if entry.dice.random() >= fault.rate:
            return [chunk]
        self.injected[fault.name, direction] += 1
        return [
            Chunk(part.data, chunk.delay_us + part.delay_us, chunk.holds_line or part.holds_line)
            for part in fault.strike(chunk.data, entry.dice)
        ]

    def _end(self, entry: ActiveFault) -> None:
        self.active.remove(entry)
        if entry.begun and isinstance(entry.fault, PartFault):
            entry.fault.end(self.parts)

    def _counter(self, entry: ActiveFault) -> partial[None]:
        return partial(self._count, entry.fault.name)

    def _count(self, name: str) -> None:
        self.injected[name, "board"] += 1

    def _free_label(self, name: str) -> str:
        taken = {entry.label for entry in self.active}
        number = 2
        label = name
        while label in taken:
            label, number = f"{name}#{number}", number + 1
        return label
