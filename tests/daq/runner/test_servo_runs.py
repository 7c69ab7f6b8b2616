"""Experiments on a bench of servos: recorded, refused and ended as on the arm that the driver was written for."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.machine import Machine, SampledPid
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from firmware_protocol.dynamixel.control_table import HardwareError, Table
from mock_controller.servos.bench import Options
from tests.daq.quiet import Quiet
from tests.daq.servo_bench import VirtualBench, pan_tilt

SPEC = ExperimentSpec(trajectory=Ramp(amplitude=math.radians(20.0), duration=0.6), settle=0.2, hold=0.3, joints=(1, 2))


@dataclass
class At(Quiet):
    """A bench, its controller, and runs on it. `at_sample[n]` is called when the n-th sample is told."""

    bench: VirtualBench
    folder: Path
    machine: Machine = field(default_factory=pan_tilt)
    at_sample: dict[int, Callable[[], object]] = field(default_factory=dict)
    samples: int = 0

    def __post_init__(self) -> None:
        self.controller: Controller = self.bench.controller()
        self.control = ArmControl(self.controller)

    def run(self, spec: ExperimentSpec = SPEC) -> RunResult:
        setup = RunSetup(
            self.controller, self.control, spec, self.machine, self.machine.limits, self.folder, self, StopRequests()
        )
        return run_experiment(setup, Consent())

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        self.samples += 1
        self.at_sample.pop(self.samples, lambda: None)()


@pytest.fixture
def at(tmp_path: Path) -> At:
    return At(VirtualBench(), tmp_path)


def told(trace: Trace, kind: str) -> list[str]:
    return [event.message for event in trace.events if event.kind == kind]


def test_a_ramp_becomes_a_trace_in_the_servos_own_time(at: At) -> None:
    result = at.run()
    assert (result.outcome, result.missing) == ("complete", 0)
    trace = read_trace(result.trace)
    assert (trace.record.period, trace.record.every, trace.record.source) == (0.001, 20, "mock")
    assert trace.record.gains == {1: (800, 0, 0), 2: (800, 0, 0)}
    assert trace.tick is not None
    assert set(np.diff(trace.tick)) <= {19, 20, 21}
    assert trace.set_point is not None
    assert np.ptp(trace.set_point, axis=0) == pytest.approx(math.radians(20.0), abs=0.002)
    assert abs(trace.position[-1] - trace.set_point[-1]).max() < 0.02


def test_the_recorded_drive_is_the_voltage_of_the_servos_own_law(at: At) -> None:
    trace = read_trace(at.run().trace)
    assert isinstance(at.machine.controller, SampledPid)
    assert trace.drive is not None
    assert trace.error is not None
    # Where a servo rests, the PWM and the error that were read together belong together.
    resting = trace.time < 0.15
    volts = at.machine.controller.gains[0][0] * trace.error[resting]
    assert trace.drive[resting] == pytest.approx(volts, abs=0.02)


def test_the_move_is_no_faster_than_its_plan(at: At) -> None:
    trace = read_trace(at.run().trace)
    assert trace.set_point is not None
    speed = np.abs(np.diff(trace.set_point, axis=0)).max() / 0.020
    assert speed < math.radians(20.0) / 0.6 * 1.1


def test_nothing_moves_while_a_torque_is_off(tmp_path: Path) -> None:
    at = At(VirtualBench(Options(torque=False)), tmp_path)
    before = at.bench.bench.angles()
    with pytest.raises(
        SafetyError, match="a drive is switched off and holds nothing: support the arm, then `daq reset`"
    ):
        at.run()
    assert at.bench.bench.angles() == before


def test_nothing_moves_after_a_stop_until_a_release(at: At) -> None:
    at.controller.stop()
    with pytest.raises(SafetyError, match="the arm has been stopped and holds its posture"):
        at.run()


def test_a_machine_file_in_other_steps_is_refused(at: At) -> None:
    assert isinstance(at.machine.controller, SampledPid)
    wrong = at.machine.controller.model_copy(update={"set_point_resolution": None})
    at.machine = at.machine.model_copy(update={"controller": wrong})
    with pytest.raises(SafetyError, match=r"in 4096 steps .* pan_tilt has 1000.* must be 0.00153398"):
        at.run()


def test_a_machine_file_with_other_joints_is_refused(tmp_path: Path) -> None:
    at = At(VirtualBench(), tmp_path)
    at.machine = at.machine.model_copy(update={"joints": at.machine.joints[:1], "modelled_joints": (1,)})
    with pytest.raises(SafetyError, match="has 2 joints, the machine file pan_tilt describes 1"):
        at.run()


@pytest.mark.parametrize(
    ("amplitude", "duration", "line"),
    [(90.0, 3.0, "joint 2: .* allowed are 108.86° to 252.10°"), (60.0, 0.2, "joint 1: 300.0 °/s .* up to 114.6 °/s")],
)
def test_range_and_speed_are_checked_before_anything_moves(
    at: At, amplitude: float, duration: float, line: str
) -> None:
    ramp = Ramp(amplitude={1: math.radians(amplitude), 2: math.radians(amplitude * 2)}, duration=duration)
    with pytest.raises(SafetyError, match=line):
        at.run(SPEC.model_copy(update={"trajectory": ramp}))
    assert all(servo[Table.BUS_WATCHDOG] == 0 for servo in at.bench.bench.servos)


def test_a_servo_that_drops_off_in_a_run_ends_it_and_the_other_is_held(at: At) -> None:
    at.at_sample[20] = lambda: at.bench.bench.gone.add(1)
    result = at.run()
    assert result.outcome == "interrupted"
    assert "servo 1 (joint 1) does not answer, the others do: has it dropped off the bus?" in result.reason
    assert "use the emergency stop" in result.reason
    held = at.bench.bench.servos[1]
    assert abs(held[Table.GOAL_POSITION] - held[Table.PRESENT_POSITION]) < 40
    at.bench.sleep_until(at.bench.now() + 1.0)
    silent = at.bench.bench.servos[0]
    assert silent[Table.BUS_WATCHDOG] == 0xFF - 0x100, "it has stopped by its own watch"


def test_a_hardware_error_in_a_run_trips_it(at: At) -> None:
    at.at_sample[20] = lambda: at.bench.bench.fail(2, HardwareError.OVERLOAD)
    result = at.run()
    assert result.outcome == "fault"
    assert "servo 2 reports overload: its joint may be without torque" in result.reason
    assert at.bench.bench.servos[0].torque, "the healthy servo goes on holding"


def test_a_torque_that_somebody_switches_off_in_a_run_stops_it(at: At) -> None:
    at.at_sample[20] = lambda: at.bench.bench.servos[1].write(Table.TORQUE_ENABLE.address, b"\0")
    result = at.run()
    assert result.outcome == "stopped"


def test_a_stop_in_a_run_freezes_within_a_few_degrees(at: At) -> None:
    at.at_sample[25] = lambda: at.control.stop("on request")
    result = at.run()
    assert result.outcome == "stopped"
    trace = read_trace(result.trace)
    assert np.ptp(trace.position[-20:], axis=0).max() < 0.02
    assert told(trace, "stop")


def test_an_unconsented_real_bench_is_not_moved(at: At) -> None:
    real = VirtualBench()
    for servo in real.bench.servos:
        servo._values[Table.MODEL_INFORMATION.address] = 0
    at.controller = real.controller()
    at.control = ArmControl(at.controller)
    with pytest.raises(SafetyError, match="is a real arm: it moves only with the operator's consent"):
        at.run()
