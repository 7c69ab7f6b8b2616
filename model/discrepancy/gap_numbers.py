"""What the numbers of a machine file would have had to become without an effect. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import GapNumber
from model.machine_model.model import base_model

MOST = 5
"""Numbers that are listed."""


def gap_numbers(machine: Machine, without: Mapping[str, float], fitted: Mapping[str, float]) -> tuple[GapNumber, ...]:
    """Numbers that would have had to move by more than a stated deviation, the furthest first.

    Args:
        without, fitted: values by name, fitted without and with the effects.
    """
    found = [
        GapNumber(name=p.name, unit=p.unit, stated=p.value, deviation=p.deviation, without=value, fitted=fitted[p.name])
        for p in base_model(machine).parameters
        if p.deviation and p.name in fitted and (value := without.get(p.name)) is not None
    ]
    moved = [n for n in found if abs(n.without - n.stated) > n.deviation]
    return tuple(sorted(moved, key=lambda n: abs(n.without - n.stated) / n.deviation, reverse=True)[:MOST])
