"""Commissioning steps in which a person moves the arm by hand while the emergency stop is pressed.

They measure the sensors, test the stop itself, and find each joint's end stops and limits at a distance from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from daq.contracts.errors import SafetyError, SpecError
from extras.commissioning.command.bench import MACHINE, MAP, Bench, NotCommissionedError
from extras.commissioning.memory.procedure import Task
from extras.commissioning.person.safe_release import give_power_back, release_after_interruption, typical
from firmware_protocol.units import ADC_COUNTS, JointCalibration, counts_to_posture

if TYPE_CHECKING:
    from extras.commissioning.person.memory_page import LinkPage
    from extras.commissioning.person.pressed import EmergencyStop
    from extras.commissioning.potentiometer import Potentiometer
    from firmware_protocol.memory_map import MemoryMap


MARGIN = math.radians(2.0)
"""Angle (rad) between limits and end stops: more than a protractor's error plus a joint's overshoot."""
LEAST_TRAVEL = ADC_COUNTS / 4
"""Least distance (ADC counts) between both readings of one joint: less is no travel from stop to stop."""
AT_THE_END = 2
"""Readings this close (ADC counts) to the converter's first or last one do not show how far beyond the joint is."""


@dataclass(frozen=True)
class EndStops:
    """One joint's end stops: angles (rad) and readings (ADC counts) there, by ascending angle.

    beyond: whether the converter was at its end there, so that the joint moves farther than the reading shows
    """

    joint: int
    angles: tuple[float, float]
    counts: tuple[float, float]
    beyond: tuple[bool, bool]

    @property
    def limits(self) -> tuple[float, float]:
        """The widest limits (rad) with a distance from the stops, and from the ends of the reading."""
        return self.angles[0] + MARGIN, self.angles[1] - MARGIN

    def __str__(self) -> str:
        low, high = (f"{math.degrees(angle):.1f}°" for angle in self.angles)
        ends = [word for word, beyond in zip(("lower", "upper"), self.beyond, strict=True) if beyond]
        text = f"joint {self.joint}: end stops at {low} and {high}"
        return f"{text}; at the {' and the '.join(ends)} one the reading ends before the joint does" if ends else text

    def as_data(self) -> dict[str, Any]:
        """Returns plain data, angles in degrees."""
        return {
            "stops_deg": [round(math.degrees(angle), 2) for angle in self.angles],
            "readings": [round(count, 1) for count in self.counts],
            "beyond_the_reading": list(self.beyond),
            "limits_deg": [round(math.degrees(limit), 2) for limit in self.limits],
        }


def end_stops_of(sensor: JointCalibration, one: float, other: float) -> EndStops:
    """Returns the end stops of a joint from its readings (ADC counts) at both, in any order.

    Raises SpecError for readings too close together.
    """
    if abs(one - other) < LEAST_TRAVEL:
        raise SpecError(
            f"joint {sensor.joint}: readings {one:.0f} and {other:.0f} at its end stops: at least {LEAST_TRAVEL:.0f} "
            "ADC counts apart are needed"
        )
    (low, first), (high, second) = sorted((sensor.counts_to_rad(counts), counts) for counts in (one, other))
    return EndStops(sensor.joint, (low, high), (first, second), (_at_the_end(first), _at_the_end(second)))


def _at_the_end(counts: float) -> bool:
    return counts < AT_THE_END or counts > ADC_COUNTS - 1 - AT_THE_END


AVERAGED = 12
"""Number of readings whose median is used at each posture of a protractor."""
LEAST_MOVED = 40
"""ADC counts by which a joint must move from one posture to the next, about 3° of a major axis."""
ATTEMPTS = 3
"""How often the postures of one joint are asked for."""
PUSHED, STAYS = 25, 5
"""ADC counts by which a joint must be pushed off its set point, and by which it may still move then."""


def potentiometers(bench: Bench) -> dict[str, Any]:
    """Measures direction, zero, range and bend of the sensors with a protractor."""
    from extras.commissioning.command.measured import with_sensors
    from extras.commissioning.person.memory_page import open_page

    memory_map = bench.memory_map()
    sensors: list[Potentiometer] = []
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.tell(True)
        if not bench.operator.begin(Task("press_emergency_stop")):
            raise SafetyError("the emergency stop must be pressed while the arm is moved by hand")
        for joint in bench.joints:
            sensors.append(_sensor(bench, page, memory_map, joint))
            bench.operator.show(sensor_line(sensors[-1]))
        give_power_back(page, bench.operator, memory_map)
        stop.tell(False)
    bench.write_machine(with_sensors(bench.machine(), sensors))  # not earlier: the previous results stay if it fails
    return {"machine": MACHINE, **{f"joint_{one.joint}": _sensor_data(one) for one in sensors}}


def _sensor(bench: Bench, page: LinkPage, memory_map: MemoryMap, joint: int) -> Potentiometer:
    """Measures the sensor of one joint. Unusable postures are asked for again, `ATTEMPTS` times in all. Raises
    SpecError."""
    from extras.commissioning.potentiometer import calibrate_potentiometer

    for attempt in range(1, ATTEMPTS + 1):
        try:
            return calibrate_potentiometer(joint, *_postures(bench, page, memory_map, joint))
        except SpecError as error:
            if attempt == ATTEMPTS:
                raise
            bench.operator.show(f"{error}. Once more from posture 1.")
    raise AssertionError("the last attempt returns or raises")


def _postures(bench: Bench, page: LinkPage, memory_map: MemoryMap, joint: int) -> tuple[list[float], list[float]]:
    """Returns readings (ADC counts) and angles (rad) of a joint at postures to which a person has moved it."""
    from extras.commissioning.potentiometer import FEWEST

    counts: list[float] = []
    angles: list[float] = []
    while len(counts) < bench.postures:
        angle = bench.operator.read_angle(joint, len(counts) + 1, page.wait)
        if angle == "taken back":
            del counts[-1:], angles[-1:]
            continue
        if angle is None:
            if len(counts) >= FEWEST:
                break
            bench.operator.show(f"joint {joint}: {len(counts)} postures, at least {FEWEST} are needed")
            continue
        reading = typical(page, memory_map, "position", AVERAGED)[joint]
        if counts and abs(reading - counts[-1]) < LEAST_MOVED:
            bench.operator.show(
                f"joint {joint} has moved by {abs(reading - counts[-1]):.0f} counts since posture {len(counts)}, at "
                f"least {LEAST_MOVED} are needed: not counted; move it further"
            )
            continue
        counts.append(reading)
        angles.append(math.radians(angle))
    return counts, angles


def sensor_line(found: Potentiometer) -> str:
    """Returns one sensor as a line for people."""
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
    """Finds each joint's end stops, led there by hand; sets limits in the machine file at a distance from them."""
    from extras.commissioning.command.measured import with_limits
    from extras.commissioning.person.memory_page import open_page

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
    bench.write_machine(with_limits(bench.machine(), {joint: one.limits for joint, one in found.items()}))
    return {"machine": MACHINE, **{f"joint_{joint}": one.as_data() for joint, one in found.items()}}


def _reading_at(bench: Bench, page: LinkPage, memory_map: MemoryMap, task: Task) -> float:
    """Returns the reading (ADC counts) of the joint that a person has moved, once they confirm it."""
    joint = task.joint or 1
    if not bench.operator.begin(task):
        raise SafetyError(f"joint {joint} was not led to its end stops")
    while not bench.operator.finished():
        bench.operator.watch({joint: counts_to_posture(round(typical(page, memory_map, "position", 1)[joint]))})
    return typical(page, memory_map, "position", AVERAGED)[joint]


def emergency_stop(bench: Bench) -> dict[str, Any]:
    """Tests whether the emergency stop cuts the drives' power: a joint then stays off its set point, whatever its
    power."""
    from extras.commissioning.person.memory_page import open_page

    memory_map, joint = bench.memory_map(), bench.joints[0]
    with open_page(bench.call.port, memory_map) as page, _emergency_stop(bench) as stop:
        stop.tell(True)
        if not bench.operator.begin(Task("press_emergency_stop")):
            raise SafetyError("the emergency stop was not pressed, so it was not tested")
        if not bench.operator.begin(Task("push", joint=joint)):
            raise SafetyError("no joint was pushed, so the emergency stop was not tested")
        while not bench.operator.finished():
            page.read()
        page.wait(0.5)
        before, error = (typical(page, memory_map, name, 5)[joint] for name in ("position", "error"))
        page.wait(1.0)
        after, power = (typical(page, memory_map, name, 5)[joint] for name in ("position", "power"))
        if abs(error) < PUSHED or abs(after - before) > STAYS or abs(power) < PUSHED / 2:
            raise NotCommissionedError(
                f"{_why_not_stopped(joint, error, after - before)} (error {error:.0f} counts, power {power:.0f}, moved "
                f"{after - before:.0f} counts; an arm without power stays {PUSHED} counts or more off its set point)"
            )
        give_power_back(page, bench.operator, memory_map)
        stop.tell(False)
    return {"joint": joint, "error_counts": round(error), "power": round(power), "moved_counts": round(after - before)}


def _why_not_stopped(joint: int, error: float, moved: float) -> str:
    """Returns advice for a pushed joint that did not stay."""
    if abs(moved) > STAYS:
        return f"joint {joint} did not stay where it was put: was the emergency stop pressed, and did you let go of it?"
    if abs(error) < PUSHED:
        return f"joint {joint} is at its set point: was the emergency stop pressed, and did you push it by 3°?"
    return f"joint {joint}: its power did not rise with its error: is the memory map right?"


def release_if_pressed(bench: Bench) -> None:
    """Releases safely an emergency stop that was pressed when the last call ended."""
    if bench.record.stop_pressed:
        found = (bench.folder / MAP).exists()
        release_after_interruption(bench.call.port, bench.operator, bench.memory_map(), found, bench.record.note_stop)


def _emergency_stop(bench: Bench) -> EmergencyStop:
    from extras.commissioning.person.pressed import EmergencyStop

    return EmergencyStop(bench.operator, bench.record.note_stop)
