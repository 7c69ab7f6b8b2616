"""Merges a configuration's limits with the machine file's. A limit that is not given stays in force."""

from __future__ import annotations

from daq.contracts.errors import SpecError
from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import Machine


def merged_limits(machine: Machine, given: Limits) -> Limits:
    """Returns the machine's limits, replaced by those in `given`, joint by joint. Raises SpecError.

    To remove a limit, use a machine file without it.
    """
    changes: dict[str, object] = {name: getattr(given, name) for name in given.model_fields_set - {"joints"}}
    if given.joints:
        count = len(machine.joints)
        if len(given.joints) != count:
            raise SpecError(f"robot.limits.joints has {len(given.joints)} entries; {machine.name} has {count} joints")
        changes["joints"] = tuple(_merged(machine, number, own) for number, own in enumerate(given.joints, start=1))
    return machine.limits.model_copy(update=changes)


def _merged(machine: Machine, number: int, given: JointLimits) -> JointLimits:
    merged = machine.limits.joint(number).model_copy(update={n: getattr(given, n) for n in given.model_fields_set})
    if merged.low is not None and merged.high is not None and merged.low >= merged.high:
        raise SpecError(f"robot.limits.joints of joint {number}: low {merged.low} must be below high {merged.high}")
    return merged
