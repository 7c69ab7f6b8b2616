"""Converts snapshots of the board in counts to rows in SI units."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.driver import BoardSnapshot


class RowMaker:
    """Converts the snapshots of one record to rows. Time 0 is the first tick.

    Raises SpecError for joints without sensor or DC motor.
    """

    def __init__(self, machine: Machine, joints: Sequence[int], period: float) -> None:
        self.joints = tuple(joints)
        self._period = period
        self._calibrations = [machine.calibration(joint) for joint in joints]
        scales = [machine.drive_scale(joint) for joint in joints]
        self._drives = [(machine.drive_sign(joint), scale) for joint, scale in zip(joints, scales, strict=True)]
        self._first: int | None = None

    def row(self, snapshot: BoardSnapshot) -> SampleRow:
        """Converts one period: angles in rad, drive in volts at the motor before any supply limit."""
        if self._first is None:
            self._first = snapshot.tick
        by_joint = dict(snapshot.joints)
        readings = [by_joint[joint] for joint in self.joints]
        both = list(zip(self._calibrations, readings, strict=True))
        return SampleRow(
            tick=snapshot.tick,
            time=(snapshot.tick - self._first) * self._period,
            host_time=snapshot.host_time,
            set_point=tuple(own.posture_to_rad(reading.set_point) for own, reading in both),
            position=tuple(own.counts_to_rad(reading.position) for own, reading in both),
            error=tuple(own.rad_per_count * reading.error for own, reading in both),
            drive=tuple(
                scale.counts_to_volts(sign * reading.power)
                for (sign, scale), reading in zip(self._drives, readings, strict=True)
            ),
            power_raw=tuple(reading.power for reading in readings),
            status=int(snapshot.flags),
            taken=snapshot.taken or 0,
        )
