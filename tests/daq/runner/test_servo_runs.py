"""A bench of servos: experiments on it, and what models and a diagnosis make of their records."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec, Multisine, Ramp
from daq.contracts.machine import Machine, SampledPid, load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from firmware_protocol.dynamixel.control_table import HardwareError, Table
from mock_controller.servos.bench import Options
from mock_controller.servos.plant import Secret, draw_secret
from model.arrays import Floats
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.machine_model.model import Model, base_model
from model.simulation.inputs import inputs_of
from model.simulation.simulate import simulate
from tests.daq.quiet import Quiet
from tests.daq.servo_bench import PAN_TILT, VirtualBench, pan_tilt, recorded

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


def test_the_recorded_drive_and_the_move_are_those_of_law_and_plan(at: At) -> None:
    trace = read_trace(at.run().trace)
    assert isinstance(at.machine.controller, SampledPid)
    assert trace.drive is not None
    assert trace.error is not None
    # Where a servo rests, the PWM and the error that were read together belong together.
    resting = trace.time < 0.15
    volts = at.machine.controller.gains[0][0] * trace.error[resting]
    assert trace.drive[resting] == pytest.approx(volts, abs=0.02)
    trace = read_trace(at.run().trace)
    assert trace.set_point is not None
    speed = np.abs(np.diff(trace.set_point, axis=0)).max() / 0.020
    assert speed < math.radians(20.0) / 0.6 * 1.1


def test_nothing_moves_without_torque_or_after_a_stop(tmp_path: Path, at: At) -> None:
    limp = At(VirtualBench(Options(torque=False)), tmp_path)
    before = limp.bench.bench.angles()
    with pytest.raises(
        SafetyError, match="a drive is switched off and holds nothing: support the arm, then `daq reset`"
    ):
        limp.run()
    assert limp.bench.bench.angles() == before
    at.controller.stop()
    with pytest.raises(SafetyError, match="the arm has been stopped and holds its posture"):
        at.run()


def test_a_machine_file_that_is_not_the_bench_s_is_refused(at: At, tmp_path: Path) -> None:
    assert isinstance(at.machine.controller, SampledPid)
    wrong = at.machine.controller.model_copy(update={"set_point_resolution": None})
    at.machine = at.machine.model_copy(update={"controller": wrong})
    with pytest.raises(SafetyError, match=r"in 4096 steps .* pan_tilt has 1000.* must be 0.00153398"):
        at.run()
    at = At(VirtualBench(), tmp_path)
    at.machine = at.machine.model_copy(update={"joints": at.machine.joints[:1], "modelled_joints": (1,)})
    with pytest.raises(SafetyError, match="has 2 joints, the machine file pan_tilt describes 1"):
        at.run()


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


# ---- What models make of the records of a bench of servos. The bench's plant shares no code with them

KNOWN = PAN_TILT.with_name("pan_tilt_known.toml")

COUNT = math.tau / 4096


def motion(seed: int, duration: float = 8.0, share: float = 1.0) -> ExperimentSpec:
    amplitude: dict[int, float] = {1: 0.3 * share, 2: 0.2 * share}
    trajectory = Multisine(amplitude=amplitude, duration=duration, lowest=0.2, highest=1.5, tones=8, seed=seed)
    return ExperimentSpec(trajectory=trajectory, joints=(1, 2), settle=0.3, hold=0.3)


def left(model: Model, trace: Trace) -> Floats:
    """Rms distance (counts) of the simulated positions from the recorded ones, by joint."""
    simulation = simulate(model, trace)
    apart = (simulation.at_samples(simulation.position) - trace.position) / COUNT
    return np.asarray(np.sqrt(np.mean(apart**2, axis=0)))


def test_a_simulation_has_an_input_for_each_tick_and_is_in_time_with_the_record(tmp_path: Path) -> None:
    trace = recorded(Options(torque=True), motion(1, 0.5, 0.1), tmp_path)
    inputs = inputs_of(trace, pan_tilt())
    assert inputs.period == 0.001
    assert len(inputs) == 20 * (len(trace) - 1) + 1
    assert not inputs.drive_of_every_period
    trace = recorded(Options(torque=True), motion(1), tmp_path)
    simulation = simulate(base_model(load_machine(str(KNOWN))), trace)
    apart = simulation.at_samples(simulation.reading) - trace.position
    speed = simulation.at_samples(simulation.velocity)
    lead = np.sum(apart * speed, axis=0) / np.sum(speed**2, axis=0)
    assert np.abs(lead).max() < 2e-4  # s; a label one tick beside the truth is 1e-3
    assert np.sqrt(np.mean(apart**2, axis=0)).max() < 0.45 * COUNT


@pytest.mark.slow
def test_the_model_with_the_numbers_of_the_data_sheet_comes_within_a_degree(tmp_path: Path) -> None:
    assert left(base_model(pan_tilt()), recorded(Options(torque=True), motion(1), tmp_path)).max() < 10


# ---- What models and a diagnosis make of records of a bench of servos that hides an effect

LOADED = 4
"""A seed that hides a load of 0.082 kg at the bar's end."""


def known() -> Model:
    """The head after its servos have been measured."""
    return base_model(load_machine(str(PAN_TILT.with_name("pan_tilt_known.toml"))))


@pytest.mark.parametrize(
    ("secret", "name", "part"),
    [
        (draw_secret(LOADED), "payload", "mass"),
        (Secret("dead_zone", 2, 0.6), "dead_zone", "width"),
        (Secret("spring_torque", 1, 0.8), "spring_torque", "stiffness"),
    ],
)
def test_the_models_effect_of_that_name_and_size_explains_what_the_bench_hides(
    secret: Secret, name: str, part: str, tmp_path: Path
) -> None:
    trace = recorded(Options(torque=True, secret=secret), motion(1, 4.0), tmp_path)
    joints = () if name == "payload" else (secret.joint,)
    values = {part: secret.size}
    if name == "spring_torque":
        values["rest"] = float(trace.position[0, 0])
    model = known()
    explained = left(model.with_effect(name, joints, values), trace)
    without = left(model, trace)
    k = secret.joint - 1
    assert explained[k] < 0.5 * without[k]
    assert explained[k] < 1.0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_hidden_load_is_named_and_its_interval_holds_the_truth(tmp_path: Path) -> None:
    secret = draw_secret(LOADED)
    fit_to, held_out = (recorded(Options(torque=True, secret=secret), motion(seed, 5.0), tmp_path) for seed in (1, 2))
    effects = ("payload", "spring_torque", "dead_zone")
    found = diagnose(known(), [fit_to], [held_out], DiagnosisOptions(joints=(2,), effects=effects))
    assert found.verdict == "named"
    assert [stage.effect for stage in found.gap.stages if stage.kind == "effect"] == ["payload"]
    mass = found.model_after.parameter("load.payload.mass").value
    assert mass == pytest.approx(secret.size, rel=0.03)
