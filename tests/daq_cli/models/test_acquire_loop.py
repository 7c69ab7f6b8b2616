"""`daq diagnose --acquire`: what is asked for is run and used, and the loop ends where it should."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from daq.contracts.errors import ReachError, SafetyError, SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.owner.messages import Finished
from daq.traces.reader import read_trace
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.models.acquire_loop import Diagnose, LoopEnd, diagnose_and_acquire
from daq_cli.robot.local import LocalRobot
from model.design.information import Planner
from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment
from model.discrepancy.experiment_design.next_experiment import ExperimentChooser
from model.machine_model.model import base_model
from tests.daq_cli.invoke import CommandLine

PORT = "mock://?lock_step=1&seed=3"


@pytest.fixture(scope="module")
def made() -> dict[str, Path]:
    """The trace once it has been made: no test changes it."""
    return {}


@pytest.fixture
def ramp(made: dict[str, Path], daq: CommandLine, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace of the source's ramp, made through the mock, once."""
    if "ramp" not in made:
        said = daq("--port", PORT, "run", "preset", "ramp", "--folder", tmp_path_factory.mktemp("ramp"), "--json")
        assert said.code == 0, said.err
        made["ramp"] = Path(json.loads(said.out)["trace"])
    return made["ramp"]


def test_an_experiment_that_is_asked_for_is_run_within_the_budget_and_used(
    daq: CommandLine, ramp: Path, tmp_path: Path
) -> None:
    asked = ("--acquire", "--budget", 12, "--effects", "coulomb", "--joints", 2, "--folder", tmp_path, "--json")
    said = daq("--port", PORT, "diagnose", ramp, *asked)
    assert said.code == 0, said.err
    found = Diagnosis.model_validate(json.loads(said.out))
    assert len(found.acquired) == 1
    run = found.acquired[0]
    assert run.outcome == "complete"
    assert 5.0 < run.duration <= 12.0
    assert run.trace == read_trace(Path(run.file)).record.trace_id
    assert found.traces == (read_trace(ramp).record.trace_id, run.trace)
    assert f"ask     {run.experiment}, " in said.err


class Answers:
    """A diagnosis that always asks for the same, and remembers what it was given."""

    def __init__(self, duration: float) -> None:
        self.duration = duration
        self.given: list[tuple[int, float | None]] = []
        self.plans: list[Planner] = []

    def __call__(self, traces: Sequence[Trace], chooser: ExperimentChooser) -> Diagnosis:
        self.given.append((len(traces), chooser.budget))
        self.plans.append(chooser.plan)
        model = base_model(load_machine("ma2000"))
        asked = NextExperiment(
            name="ramp",
            spec=ExperimentSpec(name="ramp"),
            duration=self.duration,
            separates=("a", "b"),
            predicted_separation=4.0,
            reason="a ramp: a and b would differ",
        )
        return Diagnosis(
            verdict="ambiguous",
            summary="a or b",
            steps=(),
            model_before=model,
            model_after=model,
            traces=(),
            next_experiment=asked,
            seconds=0.0,
            robot_seconds=0.0,
        )


class Arm(LocalRobot):
    """A robot whose every run gives the same trace, and ends as the test says."""

    def __init__(self, trace: Path, *outcomes: Outcome) -> None:
        super().__init__(Invocation(port_option=PORT))
        self.outcomes = list(outcomes)
        self.trace = trace
        self.moved: list[Machine] = []
        """The machines that the runs were for."""

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        self.moved.append(machine)
        samples = len(read_trace(self.trace))
        return Finished(
            trace=self.trace, outcome=self.outcomes.pop(0), reason="", samples=samples, missing=0, counters={}
        )


def loop(arm: LocalRobot, traces: list[Trace], budget: float, diagnose: Diagnose) -> LoopEnd:
    """The loop on traces of the shipped machine."""
    machine = load_machine("ma2000")
    return diagnose_and_acquire(arm, machine, traces, None, budget, ConsentPrompt(given=False), diagnose)


def test_remaining_robot_time_limits_further_experiments(ramp: Path) -> None:
    trace = read_trace(ramp)
    duration = float(trace.time[-1] - trace.time[0])
    answers = Answers(duration)
    ended = loop(Arm(ramp, *["complete"] * 9), [trace], 2.5 * duration, answers)
    found, every = ended.found, ended.traces
    assert ended.failure is None
    assert len(found.acquired) == 2
    assert len(every) == 3
    assert [count for count, _ in answers.given] == [1, 2, 3]
    assert [left for _, left in answers.given] == pytest.approx([2.5 * duration, 1.5 * duration, 0.5 * duration])


@pytest.mark.parametrize("outcome", ["stopped", "fault", "interrupted"])
def test_a_run_that_is_not_complete_ends_the_loop_and_is_not_used(ramp: Path, outcome: Outcome) -> None:
    answers = Answers(3.0)
    ended = loop(Arm(ramp, outcome), [read_trace(ramp)], 60.0, answers)
    assert [run.outcome for run in ended.found.acquired] == [outcome]
    assert len(ended.traces) == len(answers.given) == 1


@pytest.mark.parametrize(("budget", "runs"), [(1.0, 1), (0.999, 0), (2.0, 2), (1.999, 1)])
def test_an_experiment_is_run_while_it_fits_into_the_remaining_robot_time(ramp: Path, budget: float, runs: int) -> None:
    trace = read_trace(ramp)
    duration = float(trace.time[-1] - trace.time[0])
    ended = loop(Arm(ramp, *["complete"] * 9), [trace], budget * duration, Answers(duration))
    assert len(ended.found.acquired) == runs


def test_experiments_stay_within_the_limits_of_the_configured_machine(ramp: Path) -> None:
    """The limits were tightened after the trace was recorded: its own no longer hold."""
    Path("daq.toml").write_text("[robot.limits]\nreach = 0.01\n")
    answers, arm = Answers(3.0), Arm(ramp, "complete")
    loop(arm, [read_trace(ramp)], 5.0, answers)
    assert [machine.limits.reach for machine in arm.moved] == [0.01]
    for plan in answers.plans:
        with pytest.raises(SafetyError):
            plan(ExperimentSpec())


def test_another_machine_or_sensor_than_that_of_the_traces_is_refused(ramp: Path) -> None:
    shipped = load_machine("ma2000")
    sensor = shipped.joint(2).sensor
    assert sensor is not None
    zero = sensor.at_zero.model_copy(update={"value": sensor.at_zero.value + 0.01})
    joint = shipped.joint(2).model_copy(update={"sensor": sensor.model_copy(update={"at_zero": zero})})
    for changes, said in (
        ({"name": "bench"}, "bench, the configured robot is ma2000"),
        ({"joints": (shipped.joint(1), joint, *shipped.joints[2:])}, "another sensor than in the traces on joint 2;"),
    ):
        machine, consent = shipped.model_copy(update=changes), ConsentPrompt(False)
        with pytest.raises(SpecError, match=said):
            diagnose_and_acquire(Arm(ramp), machine, [read_trace(ramp)], None, 60.0, consent, Answers(3.0))


@pytest.mark.parametrize(("outcome", "code"), [("complete", 0), ("stopped", 6), ("fault", 5), ("interrupted", 5)])
def test_the_answer_is_printed_and_the_exit_code_is_that_of_the_last_run(
    daq: CommandLine, ramp: Path, monkeypatch: pytest.MonkeyPatch, outcome: str, code: int
) -> None:
    run = Acquired(experiment="ramp", trace="abc", file="abc.mcap", outcome=outcome, duration=3.0, reason="")

    def made(_robot: object, _machine: object, traces: list[Trace], *_: object, design: bool) -> LoopEnd:
        assert not design
        found = Answers(3.0)(traces, ExperimentChooser((), lambda _: pytest.fail("nothing is planned")))
        return LoopEnd(found.model_copy(update={"acquired": (run,)}), traces)

    monkeypatch.setattr("daq_cli.models.acquire_loop.diagnose_and_acquire", made)
    said = daq("diagnose", ramp, "--acquire", "--json")
    assert said.code == code
    assert Diagnosis.model_validate(json.loads(said.out)).acquired == (run,)


def test_an_absent_robot_is_reported_before_anything_is_computed(
    daq: CommandLine, ramp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("model.discrepancy.workflow.diagnose", lambda *_, **__: pytest.fail("it was computed"))
    nowhere = daq("--port", "serial:///dev/ttyNOPE", "diagnose", ramp, "--acquire", "--yes", "--json")
    nowhere.complains(3, "/dev/ttyNOPE does not exist")
    daq("--port", "mock://?modify=gremlin", "diagnose", ramp, "--acquire").complains(3, "mock controller did not start")


def test_the_answer_survives_a_run_that_cannot_begin(
    daq: CommandLine, ramp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(*_: object) -> Finished:
        raise ReachError("the arm is gone")

    def answers(_model: object, traces: list[Trace], *_: object, chooser: ExperimentChooser) -> Diagnosis:
        return Answers(3.0)(traces, chooser)

    monkeypatch.setattr(LocalRobot, "acquire", gone)
    monkeypatch.setattr("model.discrepancy.workflow.diagnose", answers)
    monkeypatch.setattr("daq_cli.commands.diagnose._written", lambda *given: given[-1])
    said = daq("--port", PORT, "diagnose", ramp, "--acquire", "--json", "-o", "so_far.json", "--report", "page.html")
    assert said.code == 3
    assert Diagnosis.model_validate(json.loads(said.out)).next_experiment is not None
    assert said.err.splitlines()[-1] == "daq: the arm is gone"
    assert "report: page.html" in said.err
    assert Path("so_far.json").exists()


def test_the_answer_survives_a_trace_that_cannot_be_used(ramp: Path) -> None:
    answers = Answers(3.0)

    def once(traces: Sequence[Trace], chooser: ExperimentChooser) -> Diagnosis:
        if len(traces) > 1:
            raise TraceError("trace abc: cannot be used")
        return answers(traces, chooser)

    ended = loop(Arm(ramp, "complete"), [read_trace(ramp)], 60.0, once)
    assert isinstance(ended.failure, TraceError)
    assert len(ended.traces) == 1
    assert [run.outcome for run in ended.found.acquired] == ["complete"]
