"""Joints without drive: their gains are 0, nothing holds them, whatever their set points are."""

from __future__ import annotations

from collections.abc import Mapping

from daq.contracts.errors import SafetyError


def limp_joints(gains: Mapping[int, tuple[int, int, int]]) -> list[int]:
    """Those whose proportional gain is 0."""
    return [joint for joint, (p, _, _) in sorted(gains.items()) if p == 0]


def limp_line(gains: Mapping[int, tuple[int, int, int]]) -> str:
    """One line about them; empty when there are none."""
    limp = limp_joints(gains)
    return f"JOINTS {', '.join(map(str, limp))} ARE LIMP (gain P is 0): nothing holds them" if limp else ""


def require_drive(gains: Mapping[int, tuple[int, int, int]]) -> None:
    """Raises SafetyError when a joint is limp: neither keys nor programs move such an arm."""
    line = limp_line(gains)
    if line:
        raise SafetyError(f"{line}; hold the arm, `daq reset --here`, then `daq gains set` them; nothing moved")
