"""Steps in which a person moves the arm by hand while the emergency stop is pressed: sensors, and the stop itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from daq.commissioning.memory.procedure import Task
from daq.contracts.errors import SafetyError
from daq_cli.commands.commission.bench import MACHINE, MAP, Bench, NotCommissionedError, typical
from firmware_protocol.units import POSTURE_UNITS

if TYPE_CHECKING:
    from daq.commissioning.potentiometer import Potentiometer
    from daq_cli.robot.memory_page import LinkPage
    from daq_cli.robot.pressed import EmergencyStop
    from firmware_protocol.memory_map import MemoryMap

AVERAGED = 12
"""Number of readings of which the median is taken at each posture of a protractor."""
PUSHED, STAYS = 25, 5
"""ADC counts by which a joint is to be pushed off its set point, and by which it may still move then."""


def potentiometers(bench: Bench) -> dict[str, Any]:
    """Direction, zero, range and bend of the sensors, by a protractor."""
    from daq.commissioning.potentiometer import calibrate_potentiometer
    from daq_cli.app.output_file import replacing
    from daq_cli.commands.commission.machine_text import measured_machine_text
    from daq_cli.robot.memory_page import open_page

    memory_map = bench.memory_map()
    sensors: list[Potentiometer] = []
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.tell(True)
        if not bench.operator.begin(Task("press_emergency_stop")):
            raise SafetyError("the emergency stop must be pressed while the arm is moved by hand")
        for joint in bench.joints:
            counts, angles = [], []
            for number in range(1, bench.postures + 1):
                angle = bench.operator.read_angle(joint, number)
                if angle is None:
                    break
                counts.append(typical(page, memory_map, "position", AVERAGED)[joint])
                angles.append(math.radians(angle))
            sensors.append(calibrate_potentiometer(joint, counts, angles))
            bench.operator.show(sensor_line(sensors[-1]))
            with replacing(bench.folder / MACHINE) as part:
                part.write_text(measured_machine_text(sensors), "utf-8")
        _give_power_back(bench, page, memory_map)
        stop.tell(False)
    bench.configure()
    return {"machine": MACHINE, **{f"joint_{one.joint}": _sensor_data(one) for one in sensors}}


def sensor_line(found: Potentiometer) -> str:
    """One sensor for people."""
    degrees = math.degrees
    return (
        f"joint {found.joint}: reading {'rises' if found.direction > 0 else 'falls'} with the angle, range "
        f"{degrees(found.range.value):.2f}° ± {degrees(found.range.half_width):.2f}°, "
        f"zero {degrees(found.at_zero.value):.2f}° ± {degrees(found.at_zero.half_width):.2f}°, "
        f"bend {100 * found.bend.value:.2f} % ± {100 * found.bend.half_width:.2f} %"
    )


def _sensor_data(found: Potentiometer) -> dict[str, Any]:
    degrees = math.degrees
    return {
        "direction": found.direction,
        "range_deg": [round(degrees(found.range.value), 3), round(degrees(found.range.half_width), 3)],
        "at_zero_deg": [round(degrees(found.at_zero.value), 3), round(degrees(found.at_zero.half_width), 3)],
        "bend_percent": [round(100 * found.bend.value, 3), round(100 * found.bend.half_width, 3)],
        "counts": [round(value, 1) for value in found.counts],
        "angles_deg": [round(degrees(value), 3) for value in found.angles],
        "residuals_deg": [round(degrees(value), 3) for value in found.residuals],
    }


def emergency_stop(bench: Bench) -> dict[str, Any]:
    """Whether the emergency stop takes the drives' power: a joint then stays off its set point, whatever its power."""
    from daq_cli.robot.memory_page import open_page

    memory_map, joint = bench.memory_map(), bench.joints[0]
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.tell(True)
        if not bench.operator.begin(Task("press_emergency_stop")):
            raise SafetyError("the emergency stop was not pressed, so nothing is known about it")
        if not bench.operator.begin(Task("push", joint=joint)):
            raise SafetyError("no joint was pushed, so nothing is known about the emergency stop")
        while not bench.operator.finished():
            page.read()
        page.wait(0.5)
        before, error = (typical(page, memory_map, name, 5)[joint] for name in ("position", "error"))
        page.wait(1.0)
        after, power = (typical(page, memory_map, name, 5)[joint] for name in ("position", "power"))
        if abs(error) < PUSHED or abs(after - before) > STAYS or abs(power) < PUSHED / 2:
            raise NotCommissionedError(
                f"joint {joint}: error {error:.0f} counts, power {power:.0f}, moved {after - before:.0f} counts; "
                f"an arm without power stays where it was put, at least {PUSHED} counts off its set point"
            )
        _give_power_back(bench, page, memory_map)
        stop.tell(False)
    return {"joint": joint, "error_counts": round(error), "power": round(power), "moved_counts": round(after - before)}


def release_if_pressed(bench: Bench) -> None:
    """The safe release of an emergency stop that was pressed when the last call ended. Without a memory map no error
    can be read: then it is released while the controller is off."""
    from daq.commissioning.memory.procedure import switched_off_and_on
    from daq_cli.robot.memory_page import open_page

    if not bench.record.stop_pressed:
        return
    bench.operator.show("The emergency stop was pressed and not released safely. Keep it pressed; this comes first.")
    memory_map = bench.memory_map()
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.pressed = True
        if not (bench.folder / MAP).exists():
            if not switched_off_and_on(page, bench.operator, "start_as_usual"):
                raise SafetyError("the controller was not switched off and on: keep the emergency stop pressed")
        else:
            if not bench.operator.begin(Task("press_emergency_stop")):
                raise SafetyError("the emergency stop must be pressed before the controller is switched off and on")
            _give_power_back(bench, page, memory_map)
        stop.tell(False)


def _give_power_back(bench: Bench, page: LinkPage, memory_map: MemoryMap) -> None:
    """Makes the posture the set points by switching off and on, and has the emergency stop released. Raises SafetyError
    where the arm would jump."""
    from daq.commissioning.memory.procedure import release, switched_off_and_on

    if not switched_off_and_on(page, bench.operator):
        raise SafetyError("the controller was not switched off and on: its set points are not where the arm is")
    if why := release(page, bench.operator, lambda: _against_power(page, memory_map)):
        raise SafetyError(why)


def _against_power(page: LinkPage, memory_map: MemoryMap) -> str:
    """Why the drives may not have power; empty if the memory is alive, error + position is each joint's set point by
    this map, and every error is small."""
    from daq.commissioning.memory.procedure import SAFE_ERROR, is_alive
    from firmware_protocol.units import posture_to_counts

    if not is_alive(page.read().data):
        return "the memory is not alive"
    told = {name: typical(page, memory_map, name, 5) for name in ("set_point", "position", "error")}
    for joint, error in told["error"].items():
        if abs(error) > SAFE_ERROR:
            return f"joint {joint} is {error:.0f} counts from its set point and would jump"
        set_point = posture_to_counts(min(max(round(told["set_point"][joint]), 0), POSTURE_UNITS - 1))
        if abs(told["position"][joint] + error - set_point) > SAFE_ERROR:
            return f"joint {joint}: error + position is not its set point, so the memory map is wrong"
    return ""


def _emergency_stop(bench: Bench) -> EmergencyStop:
    from daq_cli.robot.pressed import EmergencyStop

    return EmergencyStop(bench.operator, bench.record.note_stop)
