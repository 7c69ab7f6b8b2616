"""Hand guiding: the guided joints go limp, a person moves the arm, and the measured positions form the path."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.experiment import Gain
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.runner.arm_control import StoppedError
from daq.runner.lag import oldest_to_act_on
from daq.safety import RestGuards
from daq.teaching.arm import TeachableArm, TeachingError
from daq.teaching.recording import RecordedPath
from daq.trajectories.set_points import control_period
from firmware_protocol.units import counts_to_posture

STILL_WITHIN = 8
"""Largest error (ADC counts) at which the gains of a guided joint are restored (an assumption); the joint then moves by
up to half a degree. No guided joint may have moved further in that time either, since set points that follow it leave
no error."""
STILL_FOR = 0.2
"""Time (s) for which the error must stay that small (an assumption). A hand that reverses direction is still for a
moment."""
SHORTEST = 2
"""Fewest samples of a path."""
FEWEST_STILL = 3
"""Fewest samples that show a guided joint at rest, for slow lines with few samples in that time (an assumption)."""
PATIENCE = 10.0
"""Time (s) for a guided arm to come to rest before its gains are restored (an assumption). With only every n-th sample
on a slow line, n times as long."""


def lead_by_nose(
    arm: TeachableArm,
    machine: Machine,
    limits: Limits,
    joints: tuple[int, ...],
    ended: Callable[[], bool],
    keep: Callable[[RecordedPath], None],
) -> None:
    """Records the positions of `joints` (rad, once per period) while they are guided by hand, until `ended`.

    The gains of the guided joints are 0 meanwhile: **hold the arm, it may sink under its weight.** Their set points
    follow the hand, so that nothing jerks when the gains are restored, which happens when the arm is at rest. The other
    joints hold their position and are guarded. `keep` gets the recorded path, however it ended.

    Raises StoppedError if the arm was stopped, TeachingError if a guard tripped. The guided joints then stay limp,
    which the error states: a joint that may be moving, or frozen elsewhere, must not become stiff.
    """
    missing = [joint for joint in joints if joint not in arm.joints]
    if missing or not joints:
        raise SpecError(f"lead: joints {list(joints)}: those sampled are {list(arm.joints)}")
    rows: list[SampleRow] = []
    limp: dict[int, Gain] = {}
    try:
        try:
            with arm.driven():
                _lead(arm, machine, limits, joints, ended, rows, limp)
        finally:
            if len(rows) >= SHORTEST:
                keep(_path(rows, arm.joints, joints, control_period(machine)))
    except StoppedError as error:
        raise StoppedError(error.cause, f"lead: {error}{_limp_line(limp)}") from error
    except DaqError as error:
        raise TeachingError(f"lead: {error}{_limp_line(limp)}") from error
    if len(rows) < SHORTEST:
        raise TeachingError(f"lead: {len(rows)} samples are no path, at least {SHORTEST} are needed")


def _lead(
    arm: TeachableArm,
    machine: Machine,
    limits: Limits,
    joints: tuple[int, ...],
    ended: Callable[[], bool],
    rows: list[SampleRow],
    limp: dict[int, Gain],
) -> None:
    """Fills `rows`. At every moment `limp` contains the joints without drive and their previous gains."""
    guards = RestGuards(machine, limits, arm.joints, led=joints, every=arm.every)
    before = arm.gains()
    if not before:
        raise TeachingError("the memory map has no gains, so no joint can be made limp to be led by hand")
    _follow_the_hand(arm, machine, joints, arm.next_sample())
    for joint in joints:
        limp[joint] = before[joint]
        arm.set_gains(joint, 0, 0, 0)
    while not ended():
        row = arm.next_sample()
        _require_calm(arm, guards, row)
        rows.append(row)
        _follow_the_hand(arm, machine, joints, row)
    _restore(arm, machine, guards, limp)


def _limp_line(limp: Mapping[int, Gain]) -> str:
    if not limp:
        return ""
    gains = ",".join(f"{joint}={'/'.join(map(str, gain))}" for joint, gain in limp.items())
    return (
        f". JOINTS {', '.join(map(str, limp))} ARE LIMP (gains 0): hold the arm, make its posture the set points with "
        f"`daq reset --here`, then `daq gains set {gains}`"
    )


def _follow_the_hand(arm: TeachableArm, machine: Machine, joints: tuple[int, ...], row: SampleRow) -> None:
    arm.set_points(_measured(arm, machine, joints, row))


def _measured(arm: TeachableArm, machine: Machine, joints: tuple[int, ...], row: SampleRow) -> dict[int, int]:
    """Joint → posture of the measured position."""
    position = dict(zip(arm.joints, row.position, strict=True))
    return {
        joint: counts_to_posture(round(machine.calibration(joint).rad_to_counts(position[joint]))) for joint in joints
    }


def _require_calm(arm: TeachableArm, guards: RestGuards, row: SampleRow) -> None:
    verdict = guards.check(row)
    if verdict.stop is not None:
        raise arm.freeze_for_stop(verdict.stop)
    if verdict.trips:
        raise arm.freeze_for_fault("; ".join(verdict.trips))


def _restore(arm: TeachableArm, machine: Machine, guards: RestGuards, limp: dict[int, Gain]) -> None:
    """Sets the set points to the present posture. Once the controller has used them and the arm stays at rest, restores
    the gains. Removes each restored joint from `limp`."""
    joints = tuple(limp)
    period = control_period(machine)
    between = arm.every * period
    oldest = oldest_to_act_on(between)
    sent: dict[int, int] = {}
    calm: list[SampleRow] = []
    for _ in range(round(PATIENCE / period)):
        row = arm.next_sample()
        _require_calm(arm, guards, row)
        if not (sent and arm.lateness <= oldest and _at_rest(arm, machine, row, sent)):
            calm.clear()
        elif calm and not _where_it_was(arm, machine, calm[0], row, joints):
            calm = [row]
        else:
            calm.append(row)
        if len(calm) >= FEWEST_STILL and len(calm) * between >= STILL_FOR:
            for joint in joints:
                arm.set_gains(joint, *limp[joint])
                del limp[joint]
            return
        sent = _measured(arm, machine, joints, row)
        arm.set_points(sent)
    raise arm.freeze_for_fault(f"the arm did not come to rest within {PATIENCE * arm.every:g} s")


def _at_rest(arm: TeachableArm, machine: Machine, row: SampleRow, sent: Mapping[int, int]) -> bool:
    for joint, set_point, position in zip(arm.joints, row.set_point, row.position, strict=True):
        if joint not in sent:
            continue
        own = machine.calibration(joint)
        taken = abs(own.posture_to_rad(sent[joint]) - set_point) < abs(own.rad_per_posture_unit) / 2
        if not taken or abs((set_point - position) / own.rad_per_count) > STILL_WITHIN:
            return False
    return True


def _where_it_was(
    arm: TeachableArm, machine: Machine, before: SampleRow, now: SampleRow, joints: tuple[int, ...]
) -> bool:
    for joint, was, position in zip(arm.joints, before.position, now.position, strict=True):
        if joint in joints and abs((position - was) / machine.calibration(joint).rad_per_count) > STILL_WITHIN:
            return False
    return True


def _path(rows: list[SampleRow], sampled: tuple[int, ...], joints: tuple[int, ...], period: float) -> RecordedPath:
    columns = [sampled.index(joint) for joint in sorted(joints)]
    return RecordedPath(
        joints=tuple(sorted(joints)),
        times=tuple((row.tick - rows[0].tick) * period for row in rows),
        positions=tuple(tuple(row.position[column] for column in columns) for row in rows),
    )
