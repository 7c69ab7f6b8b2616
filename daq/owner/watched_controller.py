"""A controller that passes every snapshot to a listener, so that the live view gets all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from daq.contracts.machine import Machine
from daq.driver import BoardSnapshot, Controller
from daq.owner.messages import LiveSample
from daq.runner.rows import RowMaker
from firmware_protocol.commands import StatusFlag


class WatchedController(Controller):
    """A controller that passes every snapshot to `listener`, which must not block."""

    listener: Callable[[BoardSnapshot], None] | None = None

    def next_snapshot(
        self,
        after: int | None = None,
        joints: Sequence[int] | None = None,
        set_points: Mapping[int, int] | None = None,
    ) -> BoardSnapshot:
        """Reads the next snapshot as `Controller.next_snapshot` does, and passes it on."""
        snapshot = super().next_snapshot(after, joints, set_points)
        if self.listener is not None:
            self.listener(snapshot)
        return snapshot


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
