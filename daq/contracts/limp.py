"""Limp joints: their proportional gain is 0, so nothing holds them, whatever their set points are."""

from __future__ import annotations

from collections.abc import Mapping

from daq.contracts.errors import SafetyError

JUMP_WITHIN = 16
"""Largest positional error (ADC counts) at which gains may be written (an assumption). A limp joint that becomes stiff
jumps by its whole error: here by at most 1° on joints 1 to 3. The static error of a held joint is smaller."""

GAINS_UNKNOWN = "gains unknown (the memory map lacks them): limp joints cannot be detected"
"""Printed in place of limp joints if no gains can be read."""


def limp_joints(gains: Mapping[int, tuple[int, int, int]]) -> list[int]:
    """Joints whose proportional gain is 0."""
    return [joint for joint, (p, _, _) in sorted(gains.items()) if p == 0]


def limp_line(gains: Mapping[int, tuple[int, int, int]]) -> str:
    """Returns a line that names the limp joints; empty if there are none."""
    limp = limp_joints(gains)
    return f"JOINTS {', '.join(map(str, limp))} ARE LIMP (gain P is 0): nothing holds them" if limp else ""


def limp_warning(gains: Mapping[int, tuple[int, int, int]]) -> str:
    """Returns why the arm may not hold its posture: limp joints, or unknown gains; empty if it holds."""
    return limp_line(gains) if gains else GAINS_UNKNOWN


def require_drive(gains: Mapping[int, tuple[int, int, int]]) -> None:
    """Raises SafetyError if a joint is known to be limp: neither keys nor programs may move such an arm. Does not raise
    if no gains are known."""
    line = limp_line(gains)
    if line:
        raise SafetyError(f"{line}; hold the arm, `daq reset --here`, then `daq gains set` them; nothing moved")


def require_no_jump(errors: Mapping[int, int], wanted: Mapping[int, tuple[int, int, int]]) -> None:
    """Raises SafetyError if a limp joint that gets gains is too far from its set point; `errors` in ADC counts."""
    far = [
        f"joint {joint} is {errors[joint]} ADC counts"
        for joint, gain in sorted(wanted.items())
        if any(gain) and joint in errors and abs(errors[joint]) > JUMP_WITHIN
    ]
    if far:
        raise SafetyError(
            f"gains refused: {', '.join(far)} from its set point, allowed are ±{JUMP_WITHIN}: it would jump there; "
            "hold the arm, make its posture the set points with `daq reset --here`, then set the gains; nothing changed"
        )
