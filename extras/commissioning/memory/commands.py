"""Proves a joint's set point by command: moves it by the smallest steps while watching the arm.

Only the low byte of a set point that readings have proved is written. The first value written is the present one; the
next is one posture unit more or less, in the direction that keeps the high byte. After each write four things must
hold: the byte holds the value, the error has changed by that unit, the other joints have not moved, and every error
except that of the step is small. Otherwise the previous value is written again, and the search ends there. The byte is
not restored if the high byte has changed meanwhile or the low byte is not a written one; the person then presses the
emergency stop.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import DaqError, SafetyError
from extras.commissioning.memory.joint import JointEvidence
from extras.commissioning.memory.procedure import SAFE_ERROR, Page
from extras.commissioning.memory.relations import position_of, signed_of
from firmware_protocol.units import POSTURE_UNITS, posture_to_counts

LONGEST_STEP = 4
"""Largest step (posture units): about a degree of a major axis."""
SETTLING_S = 0.3
"""Time (s) from a step until the arm is checked."""
MOVED = 2.5
"""Least movement (ADC counts) that counts as a movement."""
OTHERS = 16
"""Largest movement (ADC counts) of the other joints."""
READINGS = 8


@dataclass(frozen=True)
class CommandProof:
    """Result of moving a joint's set point.

    proved:   whether the error followed the set point that was written
    step:     the largest step that was written (posture units, signed); 0 if none
    moved:    ADC counts by which the joint moved with that step
    sign:     1 if the joint moved towards the set point, -1 if away from it, 0 if it did not move
    problem:  why the proof was not completed; empty otherwise
    """

    joint: int
    proved: bool
    step: int
    moved: float
    sign: int
    problem: str = ""


@dataclass(frozen=True)
class _Seen:
    positions: Mapping[int, float]
    errors: Mapping[int, float]


def prove_by_command(page: Page, joints: Sequence[JointEvidence], joint: int) -> CommandProof:
    """Moves one joint by a unit, by more only while it does not move, and restores the set point."""
    own = next(one for one in joints if one.joint == joint)
    place = None if own.set_point is None else own.set_point.place
    if own.pair is None or place is None or place.high is None:
        return CommandProof(joint, False, 0, 0.0, 0, "the address of its set point is not proved")
    before = _look(page, joints)
    low, high = page.base + place.low, page.base + place.high
    there = page.read_byte(low) | page.read_byte(high) << 8
    expected = before.positions[joint] + before.errors[joint]
    if not 0 <= there < POSTURE_UNITS or abs(posture_to_counts(there) - expected) > MOVED:
        return CommandProof(
            joint, False, 0, 0.0, 0, f"its set point reads {there}, but error + position is {expected:.0f}"
        )
    result = CommandProof(joint, False, 0, 0.0, 0)
    direction = 1 if (there & 0xFF) + LONGEST_STEP <= 0xFF and there + LONGEST_STEP < POSTURE_UNITS else -1
    wrote = {there & 0xFF}
    try:
        for step in range(LONGEST_STEP + 1):
            wanted = there + direction * step
            wrote.add(wanted & 0xFF)
            page.write_byte(low, wanted & 0xFF)
            page.wait(SETTLING_S)
            result = _judge(page, joints, joint, before, (wanted, low, high), direction * step)
            if result.problem or result.sign:
                break
    except BaseException as error:
        if problem := _restored(page, low, high, there, wrote):
            raise SafetyError(f"joint {joint}: {problem} ({error or type(error).__name__})") from error
        raise
    if problem := _restored(page, low, high, there, wrote):
        both = f"{result.problem}; {problem}" if result.problem else problem
        return replace(result, proved=False, problem=both)
    page.wait(SETTLING_S)
    return result


def _restored(page: Page, low: int, high: int, there: int, wrote: Collection[int]) -> str:
    """Writes the old low byte again, if the high byte is unchanged and the present low byte was written here.

    Otherwise it would be another posture, far away. Returns why it was not written; empty if it was.
    """
    try:
        high_now, low_now = page.read_byte(high), page.read_byte(low)
        if high_now == there >> 8 and low_now in wrote:
            page.write_byte(low, there & 0xFF)
            return ""
    except DaqError as error:
        return f"the previous set point could not be written again, press the emergency stop: {error}"
    return f"the set point now reads {low_now | high_now << 8}, so nothing more is written: press the emergency stop"


def _judge(
    page: Page, joints: Sequence[JointEvidence], joint: int, before: _Seen, wrote: tuple[int, int, int], step: int
) -> CommandProof:
    wanted, low, high = wrote
    held = page.read_byte(low) | page.read_byte(high) << 8
    now = _look(page, joints)
    moved = now.positions[joint] - before.positions[joint]
    if held != wanted:
        return CommandProof(joint, False, step, moved, 0, f"wrote {wanted}, but {held} was read back")
    others = [j for j in now.positions if j != joint and abs(now.positions[j] - before.positions[j]) > OTHERS]
    if others:
        return CommandProof(joint, False, step, moved, 0, f"joint {others[0]} moved with it")
    allowed = {j: SAFE_ERROR + (abs(posture_to_counts(abs(step))) if j == joint else 0) for j in now.errors}
    far = [j for j, error in now.errors.items() if abs(error) > allowed[j]]
    if far:
        problem = f"the error of joint {far[0]} is {now.errors[far[0]]:.0f}: press the emergency stop"
        return CommandProof(joint, False, step, moved, 0, problem)
    target = now.positions[joint] + now.errors[joint]
    if abs(target - posture_to_counts(wanted)) > MOVED:
        problem = f"wrote {wanted}, which is {posture_to_counts(wanted)} counts; error + position is {target:.0f}"
        return CommandProof(joint, False, step, moved, 0, problem)
    sign = 0 if step == 0 or abs(moved) < MOVED else (1 if moved * step > 0 else -1)
    problem = "it moves away from its set point: press the emergency stop" if sign < 0 else ""
    return CommandProof(joint, step != 0, step, moved, sign, problem)


def _look(page: Page, joints: Sequence[JointEvidence]) -> _Seen:
    pages = np.frombuffer(b"".join(page.read().data for _ in range(READINGS)), np.uint8).reshape(READINGS, -1)
    known = [(one.joint, one.pair) for one in joints if one.pair is not None]
    return _Seen(
        {joint: float(np.median(position_of(pages, pair.position))) for joint, pair in known},
        {joint: float(np.median(signed_of(pages, pair.error))) for joint, pair in known},
    )
