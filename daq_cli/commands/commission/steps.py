"""The steps of a commissioning, in order: what each does, what to watch, how to stop, and its result."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from daq.commissioning.memory.procedure import Operator, Task
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SafetyError, SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console
from daq_cli.commands.commission.record import Record
from firmware_protocol.units import POSTURE_UNITS

if TYPE_CHECKING:
    from daq.commissioning.memory.commands import CommandProof
    from daq.commissioning.memory.findings import Findings
    from daq.commissioning.potentiometer import Potentiometer
    from daq.driver import Controller
    from daq_cli.robot.memory_page import LinkPage
    from daq_cli.robot.pressed import EmergencyStop
    from firmware_protocol.memory_map import MemoryMap

ROUND_TRIPS = 200
"""Number of single bytes read to judge the line."""
PERIODS = 150
"""Number of control periods over which the period is measured."""
AVERAGED = 12
"""Number of readings of which the median is taken at each posture of a protractor."""
SAME_READING = 12
"""Largest difference (ADC counts) between a position by the bridge's memory map and by the one that was found."""
PUSHED, STAYS = 25, 5
"""ADC counts by which a joint is to be pushed off its set point, and by which it may still move then."""
CONFIG, MAP, FINDINGS, MACHINE = "daq.toml", "memory_map.toml", "memory_findings.json", "machine.toml"
TO_GAIN = (1, 2, 3)


GAINS, SIGNALS = ("gain_p", "gain_i", "gain_d"), ("process_inputs", "process_outputs")
NOT_TO_BE_SKIPPED = ("bridge", "ramp")
"""Steps whose result the steps after them rely on."""
RESTS_ON = {
    "bridge": ("port", "memory_map"),
    "potentiometers": ("memory_map",),
    "emergency_stop": ("port", "memory_map"),
    "gain": ("machine",),
    "first_ramp": ("machine",),
    "ramp": ("machine",),
    "model": ("machine",),
}
"""What a step's result rests on directly; it also rests on the steps that it needs."""


class NotCommissionedError(DaqError):
    """A step whose result does not permit the next one."""

    exit_code = exit_codes.NOT_REACHED


class Commissioner(Operator, Protocol):
    """The person at the arm, who also reads a protractor."""

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        """Whether a step may begin; False to leave it open. Asked for every step at the arm, whatever `yes` says."""

    def read_angle(self, joint: int, number: int) -> float | None:
        """The angle (degrees) of a joint at posture `number`, after it was moved there by hand; None for no more."""


@dataclass
class Bench:
    """What the steps share: the folder of the arm, the port, the person, and what has been found."""

    call: Invocation
    folder: Path
    operator: Commissioner
    consent: ConsentPrompt
    record: Record
    joints: tuple[int, ...] = (1, 2, 3)
    postures: int = 6

    @property
    def configured(self) -> Invocation:
        """An invocation that uses the files which the steps have written."""
        return Invocation(config_file=self.folder / CONFIG, port_option=self.call.port)

    def memory_map(self) -> MemoryMap:
        """The memory map that was found, or the configured one."""
        from daq.config.robot_files import load_memory_map

        path = self.folder / MAP
        return load_memory_map(path if path.exists() else self.call.settings.robot.memory_map)

    def basis(self) -> dict[str, str]:
        """What a result rests on: the port, and the memory map and machine file that there are."""
        files = {"memory_map": self.folder / MAP, "machine": self.folder / MACHINE}
        return {"port": self.call.port} | {
            name: sha256(path.read_bytes()).hexdigest()[:16] if path.exists() else "none"
            for name, path in files.items()
        }

    def configure(self) -> None:
        """Writes daq.toml with the files that there are."""
        from daq.config.toml_text import settings_text
        from daq_cli.app.output_file import replacing

        settings = self.call.settings
        changes: dict[str, Any] = {"port": self.call.port}
        if (self.folder / MAP).exists():
            changes["memory_map"] = (self.folder / MAP).absolute()
        if (self.folder / MACHINE).exists():
            changes["machine"] = str((self.folder / MACHINE).absolute())
        robot = settings.robot.model_copy(update=changes)
        traces = settings.traces.model_copy(update={"folder": (self.folder / "traces").absolute()})
        with replacing(self.folder / CONFIG) as part:
            part.write_text(settings_text(settings.model_copy(update={"robot": robot, "traces": traces})), "utf-8")


class Step(NamedTuple):
    """One step: what it does, what to watch, how to stop, and the function that returns its result."""

    name: str
    title: str
    does: str
    watch: str
    stop: str
    run: Callable[[Bench], dict[str, Any]]
    needs: tuple[str, ...] = ()
    """Steps that have to be done, or left out on purpose where that is safe, before this one."""
    at_the_arm: bool = True
    """Whether a person at the arm has to say that it may begin, even with --yes."""


def line(bench: Bench) -> dict[str, Any]:
    """Round trips, repeats and damage of the line, and what the bridge says about itself."""
    from firmware_protocol.commands import Capability

    with _page(bench) as page:
        times = []
        for _ in range(ROUND_TRIPS):
            begun = time.perf_counter()
            page.read_byte(page.base)
            times.append(1e3 * (time.perf_counter() - begun))
        counters = page.link.counters.numbers()
        hello = page.hello
    bench.configure()
    capabilities = [flag.name.lower() for flag in Capability(hello.capabilities) if flag.name]
    return {
        "port": bench.call.port,
        "protocol": hello.version,
        "capabilities": capabilities,
        "period_stated_ms": hello.period_us / 1e3,
        "round_trip_median_ms": round(float(np.median(times)), 3),
        "round_trip_worst_ms": round(max(times), 3),
        "repeated": int(counters.get("retries", 0)),
        "damaged": int(counters.get("damaged", 0)),
    }


def memory(bench: Bench) -> dict[str, Any]:
    """The memory map, by `daq memory find`."""
    from daq_cli.commands.memory import findings_text, keep_map, search

    def when_found(found: Findings) -> None:
        if keep_map(found, bench.folder / MAP):
            bench.configure()
            bench.record.keep("memory", _memory_result(found, []))

    with _page(bench) as page:
        found, proofs = search(
            bench.call,
            page,
            bench.operator,
            bench.consent,
            bench.folder / FINDINGS,
            inputs=True,
            commands=True,
            when_found=when_found,
            pressed=bench.record.note_stop,
        )
    bench.operator.show(findings_text(found, proofs))
    bench.configure()
    if found.memory_map("") is None:
        names = ", ".join(sorted({one.register for one in found.missing()}))
        raise NotCommissionedError(
            f"no memory map, for these have no place: {names}; {FINDINGS} has what was found. Complete a map by "
            f"hand as {MAP} (`daq config copy memory-map` gives one to start from), then go on with --skip memory"
        )
    return _memory_result(found, proofs)


def _memory_result(found: Findings, proofs: Sequence[CommandProof]) -> dict[str, Any]:
    verdicts = [one.verdict for one in found.all]
    set_points = [found.of("set_point", joint).is_found for joint in range(1, 7)]
    return {
        "map": MAP,
        "findings": FINDINGS,
        "found": sum(one.is_found for one in found.all),
        "assumed": verdicts.count("assumed"),
        "contradicts_the_documented": verdicts.count("contradicts"),
        "set_points_at_power_up": "the measured posture" if all(set_points) else "not seen",
        "proved_by_command": [proof.joint for proof in proofs if proof.proved and not proof.problem],
        "drive_signs": [proof.sign for proof in proofs],
    }


def bridge(bench: Bench) -> dict[str, Any]:
    """Whether the bridge works by the memory map that was found."""
    from daq_cli.robot.memory_page import open_page

    memory_map = bench.memory_map()
    with open_page(bench.call.port, memory_map) as page:
        own = {name: _typical(page, memory_map, name, 5) for name in ("set_point", "position", "error", "power")}
        still = {name: _typical(page, memory_map, name, 5) for name in (*GAINS, *SIGNALS)}
    with _controller(bench) as controller:
        told = controller.errors_positions_powers()
        gains, process = controller.gains(), controller.process()
    far = [
        f"{name.replace('_', ' ')} {joint}"
        for name, values in own.items()
        for joint, value in values.items()
        if abs(getattr(told[joint], name) - value) > (SAME_READING if name != "set_point" else 0)
    ]
    far += [
        f"{name.replace('_', ' ')} {joint}"
        for index, name in enumerate(GAINS)
        for joint, value in still[name].items()
        if gains[joint][index] != value
    ]
    signals = (process.inputs, process.outputs)
    far += [name.replace("_", " ") for name, value in zip(SIGNALS, signals, strict=True) if still[name][1] != value]
    if far:
        raise NotCommissionedError(
            f"the bridge reads {', '.join(far[:6])} elsewhere than {MAP} says: it works by another map. "
            "Give it this one (a mock: --memory-map; a board: docs/hardware.md), then run `daq commission` again"
        )
    return {"positions": [round(value) for _, value in sorted(own["position"].items())]}


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
                counts.append(_positions(page, memory_map, AVERAGED)[joint])
                angles.append(math.radians(angle))
            sensors.append(calibrate_potentiometer(joint, counts, angles))
            bench.operator.show(sensor_line(sensors[-1]))
            with replacing(bench.folder / MACHINE) as part:
                part.write_text(measured_machine_text(sensors), "utf-8")
        _give_power_back(bench, page, memory_map)
        stop.tell(False)
    bench.configure()
    return {"machine": MACHINE, **{f"joint_{one.joint}": _sensor_data(one) for one in sensors}}


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
    told = {name: _typical(page, memory_map, name, 5) for name in ("set_point", "position", "error")}
    for joint, error in told["error"].items():
        if abs(error) > SAFE_ERROR:
            return f"joint {joint} is {error:.0f} counts from its set point and would jump"
        set_point = posture_to_counts(min(max(round(told["set_point"][joint]), 0), POSTURE_UNITS - 1))
        if abs(told["position"][joint] + error - set_point) > SAFE_ERROR:
            return f"joint {joint}: error + position is not its set point, so the memory map is wrong"
    return ""


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


def _emergency_stop(bench: Bench) -> EmergencyStop:
    from daq_cli.robot.pressed import EmergencyStop

    return EmergencyStop(bench.operator, bench.record.note_stop)


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
        before, error = (_typical(page, memory_map, name, 5)[joint] for name in ("position", "error"))
        page.wait(1.0)
        after, power = (_typical(page, memory_map, name, 5)[joint] for name in ("position", "power"))
        if abs(error) < PUSHED or abs(after - before) > STAYS or abs(power) < PUSHED / 2:
            raise NotCommissionedError(
                f"joint {joint}: error {error:.0f} counts, power {power:.0f}, moved {after - before:.0f} "
                f"an arm without power stays where it was put, at least {PUSHED} counts off its set point"
            )
        _give_power_back(bench, page, memory_map)
        stop.tell(False)
    return {"joint": joint, "error_counts": round(error), "power": round(power), "moved_counts": round(after - before)}


def stop(bench: Bench) -> dict[str, Any]:
    """The program's stop, from the request to the board's confirmation."""
    with _controller(bench) as controller:
        bench.consent.require(bench.call.port, controller.identity)
        begun = time.perf_counter()
        confirmation = controller.stop()
        taken = 1e3 * (time.perf_counter() - begun)
        if not confirmation.acknowledged:
            raise NotCommissionedError(f"the stop was not confirmed: {confirmation.problem}. Use the emergency stop")
        controller.release()
    return {
        "confirmed_ms": round(taken, 2),
        "frozen": [confirmation.frozen[joint] for joint in sorted(confirmation.frozen)],
    }


def period(bench: Bench) -> dict[str, Any]:
    """The control period by the host's clock."""
    with _controller(bench) as controller:
        ticks, times, after = [], [], None
        for _ in range(PERIODS):
            snapshot = controller.next_snapshot(after, (1,))
            after = snapshot.tick
            ticks.append(snapshot.tick)
            times.append(snapshot.host_time)
        missed = controller.status().missed
    slope = float(np.polyfit(ticks, times, 1)[0]) if ticks[-1] > ticks[0] else math.nan
    left = np.asarray(times) - np.polyval(np.polyfit(ticks, times, 1), ticks)
    return {
        "period_ms": round(1e3 * slope, 4),
        "jitter_ms": round(1e3 * float(np.std(left)), 3),
        "missed_set_points": missed,
        "computing_delay": "not measured: the machine file's assumption stands",
    }


def gain(bench: Bench) -> dict[str, Any]:
    """Volts per radian of each joint, by `daq calibrate gain`."""
    from daq.calibration import gain_experiment, gains_from_trace
    from daq.traces.reader import read_trace
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_access(bench.configured)
    joints = tuple(joint for joint in bench.joints if joint in TO_GAIN)
    done = acquire_complete(robot, gain_experiment(joints), robot.machine, robot.call.trace_folder, bench.consent)
    found = gains_from_trace(read_trace(done.trace), robot.machine)
    for one in found:
        bench.operator.show(str(one))
    return {"trace": str(done.trace), "gains": {f"joint_{one.joint}": str(one) for one in found if one.joint in joints}}


def first_ramp(bench: Bench) -> dict[str, Any]:
    """A ramp of joint 1."""
    return _ramp(bench, (1,))


def ramp(bench: Bench) -> dict[str, Any]:
    """The ramp step of the source, on joints 1 to 3."""
    return _ramp(bench, (1, 2, 3))


def model(bench: Bench) -> dict[str, Any]:
    """Whether the arm behaves as its machine file says."""
    from daq.traces.reader import read_trace
    from model.comparison.compare import compare
    from model.machine_model.model import base_model

    if "trace" not in bench.record.steps.get("ramp", {}):
        raise SpecError("the step ramp has left no trace: do it first (--only ramp)")
    trace = read_trace(Path(bench.record.steps["ramp"]["trace"]))
    machine = bench.configured.settings.machine()
    compared = compare([("machine file", base_model(machine))], [trace])
    joints = compared.models[0].in_sample or ()
    left = {f"joint_{one.joint}_counts": round(one.counts, 2) for one in joints if one.counts is not None}
    above = [one.joint for one in joints if one.rmse > 2 * one.floor]
    return {
        **left,
        "above_the_noise_floor": above,
        "next": f"daq diagnose {bench.record.steps['ramp']['trace']}"
        if above
        else "nothing: the model explains the ramp",
    }


def _ramp(bench: Bench, joints: tuple[int, ...]) -> dict[str, Any]:
    from daq.contracts.experiment import ExperimentSpec
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_access(bench.configured)
    spec = ExperimentSpec(name="commission-ramp", joints=joints)
    done = acquire_complete(robot, spec, robot.machine, robot.call.trace_folder, bench.consent)
    return {"trace": str(done.trace), "samples": done.samples, "missing": done.missing, "outcome": done.outcome}


SEE = "It only reads; nothing moves."
KEY = "Ctrl-C, `daq stop` in another terminal, or the emergency stop"
BEFORE_MOVING = ("bridge", "potentiometers", "emergency_stop", "stop")
STEPS = (
    Step("line", "Port and line", "Reads one byte 200 times.", SEE, "Ctrl-C", line, at_the_arm=False),
    Step(
        "memory",
        "Memory map",
        "Finds what lies where, while you move the arm by hand; at the end moves each joint by a degree and back.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop; q or Ctrl-C ends the search",
        memory,
    ),
    Step(
        "bridge",
        "The bridge's memory map",
        "Compares the bridge's readings with the map that was found.",
        SEE,
        "Ctrl-C",
        bridge,
        ("memory",),
        at_the_arm=False,
    ),
    Step(
        "potentiometers",
        "Potentiometers",
        "Reads each joint at five postures or more, whose angles you measure with a protractor.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop stays pressed throughout",
        potentiometers,
        ("memory",),
    ),
    Step(
        "emergency_stop",
        "Emergency stop",
        "Reads whether a joint that you push off its set point stays there while the emergency stop is pressed.",
        "The arm, which may sink while the emergency stop is pressed.",
        "the emergency stop stays pressed",
        emergency_stop,
        ("memory",),
    ),
    Step(
        "stop",
        "The program's stop",
        "Stops the resting arm and releases it again.",
        "The arm stays where it is.",
        KEY,
        stop,
        ("bridge",),
    ),
    Step(
        "period", "Control period", "Follows 150 control periods.", SEE, "Ctrl-C", period, ("bridge",), at_the_arm=False
    ),
    Step(
        "gain",
        "Gain of each joint",
        "Moves the joints by steps of 1 to 3 degrees at three postures.",
        "The arm.",
        KEY,
        gain,
        BEFORE_MOVING,
    ),
    Step(
        "first_ramp",
        "First ramp, joint 1",
        "Moves joint 1 by 21.6 degrees in 0.65 s.",
        "The arm.",
        KEY,
        first_ramp,
        BEFORE_MOVING,
    ),
    Step(
        "ramp",
        "Ramp, joints 1 to 3",
        "Moves joints 1 to 3 by 21.6 degrees in 0.65 s.",
        "The arm.",
        KEY,
        ramp,
        (*BEFORE_MOVING, "first_ramp"),
    ),
    Step(
        "model",
        "The model",
        "Compares the ramp with the machine file.",
        "It only computes.",
        "Ctrl-C",
        model,
        ("ramp",),
        at_the_arm=False,
    ),
)
"""All steps, in order."""


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


def _page(bench: Bench) -> Any:
    from daq_cli.robot.memory_page import open_page

    console().print(f"    {bench.call.port}")
    return open_page(bench.call.port, bench.memory_map())


def _controller(bench: Bench) -> Controller:
    from daq.driver import Controller

    return Controller.connect(bench.call.port, bench.memory_map())


def _positions(page: LinkPage, memory_map: MemoryMap, count: int = 5) -> dict[int, float]:
    """Positions (ADC counts) from a number of readings."""
    return _typical(page, memory_map, "position", count)


def _typical(page: LinkPage, memory_map: MemoryMap, name: str, count: int) -> dict[int, float]:
    """A register of each joint: the median of its readings, of which some may be torn."""
    register = memory_map[name]
    values: dict[int, list[int]] = {joint: [] for joint in range(1, len(register.low) + 1)}
    for _ in range(count):
        data = page.read().data
        for joint, of_joint in values.items():
            high = 0 if register.high is None else data[register.high[joint - 1] - page.base]
            of_joint.append(register.decode(data[register.low[joint - 1] - page.base], high))
    return {joint: float(np.median(one)) for joint, one in values.items()}


def lacking(step: Step, record: Record) -> list[str]:
    """The steps that have to be done before this one. Some may be left out with --skip."""
    return [
        name
        for name in step.needs
        if name not in record.steps or (name in NOT_TO_BE_SKIPPED and record.steps[name].get("skipped"))
    ]


def resting_on(names: Collection[str]) -> set[str]:
    """The steps whose results rest on these steps, directly or not."""
    found: set[str] = set()
    for step in STEPS:  # in order, so that one pass is enough
        if {*names, *found} & set(step.needs):
            found.add(step.name)
    return found


def stale(bench: Bench) -> set[str]:
    """The steps whose results were found at another port, or with another memory map or machine file, and those that
    rest on them."""
    now = bench.basis()
    changed = {
        name
        for name, of in RESTS_ON.items()
        if name in bench.record.steps and not bench.record.steps[name].get("skipped")
        if any(bench.record.steps[name].get("basis", {}).get(what) != now[what] for what in of)
    }
    return changed | {name for name in resting_on(changed) if not bench.record.steps.get(name, {}).get("skipped")}


def step_named(name: str) -> Step:
    """A step by its name. Raises SpecError."""
    for one in STEPS:
        if one.name == name:
            return one
    raise SpecError(f"step {name!r}: there are {', '.join(one.name for one in STEPS)}")
