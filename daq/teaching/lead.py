"""Lead by the nose: the led joints go limp, a hand moves the arm, what the sensors say is the path (section 6.4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from daq.contracts.errors import DaqError
from daq.contracts.experiment import Gain
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.safety import RestGuards
from daq.teaching.arm import TeachableArm, TeachingError
from daq.teaching.recording import RecordedPath
from daq.trajectories import control_period
from firmware_protocol.units import counts_to_posture

STILL_WITHIN = 8
"""ADC counts of error up to which the gains of a led joint come back: an assumption, a pull of half a degree."""
STILL_FOR = 0.2
"""Time (s) for which it must be so without a break: an assumption. A hand that turns round is still for a moment."""
PATIENCE = 10.0
"""Time (s) that a led arm has to come to rest before its gains come back: an assumption."""


def lead_by_nose(
    arm: TeachableArm, machine: Machine, limits: Limits, joints: tuple[int, ...], ended: Callable[[], bool]
) -> RecordedPath:
    """Records the positions of `joints` (rad, once a period) while they are led by hand, until `ended`.

    The gains of the led joints are 0 meanwhile: **the arm must be held, it may sink under its weight.** Their set
    points follow the hand, so that nothing pulls when the gains come back; they come back when the arm is at rest.
    Joints not led hold their place and are watched. Raises TeachingError when the arm was stopped or a guard tripped,
    with the gains still 0: nothing is ever made stiff that may be moving or frozen elsewhere.
    """
    missing = [joint for joint in joints if joint not in arm.joints]
    if missing or not joints:
        raise TeachingError(f"lead: joints {list(joints)}: those sampled are {list(arm.joints)}")
    before = {joint: arm.gains()[joint] for joint in joints}
    guards = RestGuards(machine, limits, arm.joints, led=joints)
    rows: list[SampleRow] = []
    try:
        _follow_the_hand(arm, machine, joints, arm.next_sample())
        for joint in joints:
            arm.set_gains(joint, 0, 0, 0)
        while not ended():
            row = arm.next_sample()
            _require_calm(arm, guards, row, joints)
            rows.append(row)
            _follow_the_hand(arm, machine, joints, row)
    except TeachingError:
        raise
    except DaqError as error:
        raise TeachingError(f"lead: {error}; the gains of joints {list(joints)} may be 0 now") from error
    except BaseException:
        _restore(arm, machine, guards, before)
        raise
    _restore(arm, machine, guards, before)
    return _path(rows, arm.joints, joints, control_period(machine))


def _follow_the_hand(arm: TeachableArm, machine: Machine, joints: tuple[int, ...], row: SampleRow) -> None:
    arm.set_points(_measured(arm, machine, joints, row))


def _measured(arm: TeachableArm, machine: Machine, joints: tuple[int, ...], row: SampleRow) -> dict[int, int]:
    """Joint → posture of the measured position."""
    position = dict(zip(arm.joints, row.position, strict=True))
    return {
        joint: counts_to_posture(round(machine.calibration(joint).rad_to_counts(position[joint]))) for joint in joints
    }


def _require_calm(arm: TeachableArm, guards: RestGuards, row: SampleRow, joints: tuple[int, ...]) -> None:
    verdict = guards.check(row)
    if verdict.trips:
        arm.stop()
    reason = "; ".join(verdict.trips) or verdict.stop
    if reason:
        raise TeachingError(f"lead: {reason}; the gains of joints {list(joints)} are still 0: set them when it is safe")


def _restore(arm: TeachableArm, machine: Machine, guards: RestGuards, gains: Mapping[int, Gain]) -> None:
    """Set points := present posture; when the controller has taken them and the arm stays at rest, the gains."""
    joints = tuple(gains)
    period = control_period(machine)
    sent: dict[int, int] = {}
    still = 0
    for _ in range(round(PATIENCE / period)):
        row = arm.next_sample()
        _require_calm(arm, guards, row, joints)
        still = still + 1 if sent and _at_rest(arm, machine, row, sent) else 0
        if still * period >= STILL_FOR:
            for joint, (p, i, d) in gains.items():
                arm.set_gains(joint, p, i, d)
            return
        sent = _measured(arm, machine, joints, row)
        arm.set_points(sent)
    raise TeachingError(
        f"lead: the arm did not come to rest within {PATIENCE:g} s; the gains of joints {list(joints)} are still 0: "
        "hold the arm still and set them"
    )


def _at_rest(arm: TeachableArm, machine: Machine, row: SampleRow, sent: Mapping[int, int]) -> bool:
    for joint, set_point, position in zip(arm.joints, row.set_point, row.position, strict=True):
        if joint not in sent:
            continue
        own = machine.calibration(joint)
        taken = abs(own.posture_to_rad(sent[joint]) - set_point) < abs(own.rad_per_posture_unit) / 2
        if not taken or abs((set_point - position) / own.rad_per_count) > STILL_WITHIN:
            return False
    return True


def _path(rows: list[SampleRow], sampled: tuple[int, ...], joints: tuple[int, ...], period: float) -> RecordedPath:
    if len(rows) < 2:
        raise TeachingError(f"lead: {len(rows)} samples are no path, at least 2 are needed")
    columns = [sampled.index(joint) for joint in sorted(joints)]
    return RecordedPath(
        joints=tuple(sorted(joints)),
        times=tuple((row.tick - rows[0].tick) * period for row in rows),
        positions=tuple(tuple(row.position[column] for column in columns) for row in rows),
    )
