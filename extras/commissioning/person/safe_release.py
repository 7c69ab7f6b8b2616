"""Releases the emergency stop safely: the drives get power only if the arm does not move."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from daq.contracts.errors import SafetyError
from extras.commissioning.memory.procedure import (
    SAFE_ERROR,
    Operator,
    Page,
    Task,
    is_alive,
    release,
    switched_off_and_on,
)
from extras.commissioning.person.pressed import EmergencyStop
from firmware_protocol.units import POSTURE_UNITS, posture_to_counts

if TYPE_CHECKING:
    from extras.commissioning.person.memory_page import LinkPage
    from firmware_protocol.memory_map import MemoryMap

FIRST = "The emergency stop was pressed and not released safely. Keep it pressed; this comes first."


def typical(page: Page, memory_map: MemoryMap, name: str, count: int) -> dict[int, float]:
    """Returns a register of each joint: the median of its readings, some of which may be torn."""
    register = memory_map[name]
    values: dict[int, list[int]] = {joint: [] for joint in range(1, len(register.low) + 1)}
    for _ in range(count):
        data = page.read().data
        for joint, of_joint in values.items():
            high = 0 if register.high is None else data[register.high[joint - 1] - page.base]
            of_joint.append(register.decode(data[register.low[joint - 1] - page.base], high))
    return {joint: float(np.median(one)) for joint, one in values.items()}


def release_after_interruption(
    port: str, operator: Operator, memory_map: MemoryMap, found: bool, note: Callable[[bool], None]
) -> None:
    """Releases an emergency stop that was pressed when the last call ended. Raises SafetyError.

    found: whether the memory map was found at this arm. If not, no error can be read, and the stop is released while
    the controller is off.
    note: called after the release
    """
    from extras.commissioning.person.memory_page import open_page

    operator.show(FIRST)
    with open_page(port, memory_map) as page, EmergencyStop(operator, note) as stop:
        stop.pressed = True
        if found:
            if not operator.begin(Task("press_emergency_stop")):
                raise SafetyError("the emergency stop must be pressed before the controller is switched off and on")
            give_power_back(page, operator, memory_map)
        elif not switched_off_and_on(page, operator, "start_as_usual"):
            raise SafetyError("the controller was not switched off and on: keep the emergency stop pressed")
        stop.tell(False)


def give_power_back(page: LinkPage, operator: Operator, memory_map: MemoryMap) -> None:
    """Makes the posture the set points by a power cycle, and has the emergency stop released.

    Raises SafetyError if the arm would jump.
    """
    if not switched_off_and_on(page, operator):
        raise SafetyError("the controller was not switched off and on, so its set points are not the arm's posture")
    if why := release(page, operator, lambda: _against_power(page, memory_map)):
        raise SafetyError(why)


def _against_power(page: LinkPage, memory_map: MemoryMap) -> str:
    """Returns why the drives may not get power; empty if they may.

    They may if the memory is live, error + position is each joint's set point by this map, and every error is small.
    """
    if not is_alive(page.read().data):
        return "the memory is not live"
    told = {name: typical(page, memory_map, name, 5) for name in ("set_point", "position", "error")}
    for joint, error in told["error"].items():
        if abs(error) > SAFE_ERROR:
            return f"joint {joint} is {error:.0f} counts from its set point and would jump"
        set_point = posture_to_counts(min(max(round(told["set_point"][joint]), 0), POSTURE_UNITS - 1))
        if abs(told["position"][joint] + error - set_point) > SAFE_ERROR:
            return f"joint {joint}: error + position is not its set point, so the memory map is wrong"
    return ""
