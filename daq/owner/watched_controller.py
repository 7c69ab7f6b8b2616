"""A controller that passes every snapshot to a listener, so that the live view gets all of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from daq.contracts.machine import Machine
from daq.driver import BoardSnapshot, Controller
from daq.owner.messages import LiveSample
from daq.runner.rows import RowMaker
from firmware_protocol.commands import StatusFlag


class WatchedController(Controller):
    """A controller that passes every snapshot to `listener`, which must not block.

    Between two activities nobody asks for samples, and the next activity begins with the newest one. The periods
    between, which the bridge has kept, are read first, so that watchers miss none.
    """

    listener: Callable[[BoardSnapshot], None] | None = None
    lost: Callable[[int, int], None] | None = None
    """Called with the number of periods that the bridge no longer had, and the tick after them."""
    _newest: BoardSnapshot | None = None
    """The newest snapshot that was passed on; None after an error, since ticks may begin anew."""

    def next_snapshot(
        self,
        after: int | None = None,
        joints: Sequence[int] | None = None,
        set_points: Mapping[int, int] | None = None,
    ) -> BoardSnapshot:
        """Reads the next snapshot as `Controller.next_snapshot` does, and passes it on."""
        if self.listener is None:
            return super().next_snapshot(after, joints, set_points)
        newest, self._newest = self._newest, None
        catches_up = after is None and self.identity.keeps_samples and self.line_rate(joints).every == 1
        if catches_up and newest is not None:
            newest = self._caught_up(newest, joints)
        snapshot = super().next_snapshot(after, joints, set_points)
        if catches_up and newest is not None:
            newest = self._pass_on_kept(newest, snapshot.tick, joints)
            self._tell_lost(newest, snapshot)
        self.listener(snapshot)
        self._newest = snapshot
        return snapshot

    def _caught_up(self, newest: BoardSnapshot, joints: Sequence[int] | None) -> BoardSnapshot:
        """Passes on what is kept by now, so that hardly anything is left to read after set points have been sent."""
        if self.clock.now() - newest.tick_time < self.period_s:
            return newest
        behind, before = self.status().tick - newest.tick, math.inf
        while 0 < behind < before:  # on a slow line as many periods pass as are read
            newest = self._pass_on_kept(newest, newest.tick + behind + 1, joints)
            behind, before = self.status().tick - newest.tick, behind
        return newest

    def _pass_on_kept(self, newest: BoardSnapshot, before: int, joints: Sequence[int] | None) -> BoardSnapshot:
        """Passes on what is kept after a snapshot and before a tick. Returns the newest of all."""
        assert self.listener is not None
        for snapshot in self.kept(newest.tick, before, joints):
            self._tell_lost(newest, snapshot)
            self.listener(snapshot)
            newest = snapshot
        return newest

    def _tell_lost(self, newest: BoardSnapshot, snapshot: BoardSnapshot) -> None:
        gone = snapshot.tick - newest.tick - 1
        if gone > 0 and self.lost is not None:
            self.lost(gone, snapshot.tick)


class SampleMaker:
    """Converts snapshots of any set of joints to samples in SI units."""

    def __init__(self, machine: Machine, period: float) -> None:
        self._machine = machine
        self._period = period
        self._rows: dict[tuple[int, ...], RowMaker] = {}

    def sample(self, snapshot: BoardSnapshot, now: float) -> LiveSample:
        """Converts a snapshot taken at the time `now` (s, monotonic)."""
        count = len(self._machine.joints)
        joints = tuple(joint for joint, _ in snapshot.joints if joint <= count)
        rows = self._rows.setdefault(joints, RowMaker(self._machine, joints, self._period))
        row = rows.row(snapshot)
        return LiveSample(
            tick=row.tick,
            host_time=now,
            joints=joints,
            set_point=row.set_point,
            position=row.position,
            error=row.error,
            drive=row.drive,
            status=row.status,
            lateness=snapshot.jitter,
        )


def is_frozen(snapshot: BoardSnapshot) -> bool:
    """Whether the board is stopped, by any host."""
    return StatusFlag.FROZEN in snapshot.flags
