"""Steps in which a person moves the arm by hand while the emergency stop is pressed: sensors, and the stop itself."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from daq.commissioning.end_stops import EndStops, end_stops_of
from daq.commissioning.memory.procedure import Task
from daq.contracts.errors import SafetyError
from daq_cli.commands.commission.bench import MACHINE, MAP, Bench, NotCommissionedError
from daq_cli.robot.safe_release import give_power_back, release_after_interruption, typical
from firmware_protocol.units import counts_to_posture

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
    from daq_cli.commands.commission.machine_text import with_sensors
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
                angle = bench.operator.read_angle(joint, number, page.wait)
                if angle is None:
                    break
                counts.append(typical(page, memory_map, "position", AVERAGED)[joint])
                angles.append(math.radians(angle))
            sensors.append(calibrate_potentiometer(joint, counts, angles))
            bench.operator.show(sensor_line(sensors[-1]))
            bench.write_machine(with_sensors(bench.machine_text(), sensors[-1:]))
        give_power_back(page, bench.operator, memory_map)
        stop.tell(False)
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


def end_stops(bench: Bench) -> dict[str, Any]:
    """Where each joint meets its end stops, led there by hand; the limits in the machine file keep clear of them."""
    from daq_cli.commands.commission.machine_text import with_limits
    from daq_cli.robot.memory_page import open_page

    memory_map, machine = bench.memory_map(), bench.machine()
    found: dict[int, EndStops] = {}
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.tell(True)
        if not bench.operator.begin(Task("press_emergency_stop")):
            raise SafetyError("the emergency stop must be pressed while the arm is moved by hand")
        for joint in bench.joints:
            ends = [_reading_at(bench, page, memory_map, Task(kind, joint)) for kind in ("end_stop", "other_end_stop")]
            found[joint] = end_stops_of(machine.calibration(joint), *ends)
            bench.operator.show(str(found[joint]))
            _reading_at(bench, page, memory_map, Task("bring_back", joint))
        give_power_back(page, bench.operator, memory_map)
        stop.tell(False)
    bench.write_machine(with_limits(bench.machine_text(), {joint: one.limits for joint, one in found.items()}))
    return {"machine": MACHINE, **{f"joint_{joint}": one.as_data() for joint, one in found.items()}}


def _reading_at(bench: Bench, page: LinkPage, memory_map: MemoryMap, task: Task) -> float:
    """The reading (ADC counts) of the joint that a person has moved, once they say that it is there."""
    joint = task.joint or 1
    if not bench.operator.begin(task):
        raise SafetyError(f"joint {joint} was not led to its end stops")
    while not bench.operator.finished():
        bench.operator.watch({joint: counts_to_posture(round(typical(page, memory_map, "position", 1)[joint]))})
    return typical(page, memory_map, "position", AVERAGED)[joint]


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
        give_power_back(page, bench.operator, memory_map)
        stop.tell(False)
    return {"joint": joint, "error_counts": round(error), "power": round(power), "moved_counts": round(after - before)}


def release_if_pressed(bench: Bench) -> None:
    """The safe release of an emergency stop that was pressed when the last call ended."""
    if bench.record.stop_pressed:
        found = (bench.folder / MAP).exists()
        release_after_interruption(bench.call.port, bench.operator, bench.memory_map(), found, bench.record.note_stop)


def _emergency_stop(bench: Bench) -> EmergencyStop:
    from daq_cli.robot.pressed import EmergencyStop

    return EmergencyStop(bench.operator, bench.record.note_stop)
