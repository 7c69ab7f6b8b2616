"""Single steps of a commissioning: the computing delay, postures of a protractor, the diagnosis."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import pytest

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.machine import load_machine
from daq.owner.stop_socket import request_stop
from daq.runner.arm_control import StoppedError
from daq.teaching.arm import TeachingError
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command import by_command
from extras.commissioning.command.bench import Bench
from extras.commissioning.command.by_hand import potentiometers
from extras.commissioning.command.delay import delay
from extras.commissioning.command.record import Record
from extras.commissioning.memory.procedure import Task
from extras.commissioning.person.mock_hand import MockOperator, mock_operator
from model.discrepancy import workflow
from model.discrepancy.options import DiagnosisOptions
from model.machine_model.model import base_model
from tests.daq_cli.board import ask
from tests.extras.commissioning.test_commission import Hand
from tests.extras.commissioning.test_whole_commissioning import mock
from tests.model.inverse_dynamics.test_fit_torques import EXAMPLES, swinging

# ---- the computing delay: whatever ends it early freezes the arm, and nothing moves it then


@pytest.fixture
def arm() -> Iterator[MockProcess]:
    port = parse_port_url("mock://?lock_step=1&seed=5")
    assert isinstance(port, MockPort)
    running = start_mock(port)
    yield running
    running.close()


@pytest.fixture
def bench(arm: MockProcess, tmp_path: Path) -> Bench:
    """With the control period measured."""
    record = Record.of(tmp_path)
    record.keep("period", {"period_ms": 20.0})
    return Bench(Invocation(port_option=f"{arm.url}?lock_step=1"), tmp_path, Hand(), ConsentPrompt(given=True), record)


def when_it_moves(arm: MockProcess, do: Callable[[], object]) -> threading.Thread:
    """Does it as soon as a set point has changed."""
    before = ask(arm, "state")["set_points"]

    def watch() -> None:
        while ask(arm, "state")["set_points"] == before:
            pass
        do()

    thread = threading.Thread(target=watch)
    thread.start()
    return thread


def from_another_terminal() -> None:
    (attempt,) = request_stop()
    assert attempt.answer is not None
    assert attempt.answer.confirmed


def ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.parametrize("stop", [from_another_terminal, ctrl_c])
def test_a_stop_is_delivered_while_set_points_are_written_and_freezes_the_arm(
    bench: Bench, arm: MockProcess, stop: Callable[[], None]
) -> None:
    asking = when_it_moves(arm, stop)
    with pytest.raises(StoppedError):
        delay(bench)
    asking.join()
    state = ask(arm, "state")
    assert state["frozen"]
    with pytest.raises(SafetyError, match="has been stopped"):
        delay(bench)
    assert ask(arm, "state")["set_points"] == state["set_points"]


def test_a_restart_of_the_controller_freezes_the_arm(bench: Bench, arm: MockProcess) -> None:
    asking = when_it_moves(arm, lambda: ask(arm, "brown_out"))
    with pytest.raises(TeachingError, match=r"the arm has been stopped by a fault: .*restarted"):
        delay(bench)
    asking.join()
    assert ask(arm, "state")["frozen"]


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ("joints = [{ low = HERE - 0.001, high = HERE + 0.001 }, {}, {}, {}, {}, {}]", "joint 1: .* allowed are"),
        ("following_error_counts = 1", "ADC counts from its set point, allowed are ±1"),
    ],
)
def test_limits_are_checked_before_anything_moves(bench: Bench, arm: MockProcess, limits: str, says: str) -> None:
    before = ask(arm, "state")
    here = load_machine("ma2000").calibration(1).posture_to_rad(before["set_points"][0])
    text = limits.replace("HERE - 0.001", str(here - 0.001)).replace("HERE + 0.001", str(here + 0.001))
    config = bench.folder / "limited.toml"
    config.write_text(f"[robot.limits]\n{text}\n")
    bench.call = Invocation(config_file=config, port_option=bench.call.port)
    with pytest.raises(SafetyError, match=says):
        delay(bench)
    after = ask(arm, "state")
    assert (after["set_points"], after["frozen"]) == (before["set_points"], False)


# ---- postures that say nothing are asked for again; what was measured before stays until all is done


@dataclass
class Clumsy:
    """Presses Enter too early, forgets to move the joint, and takes one posture back."""

    hand: MockOperator
    folder: Path
    told: list[str] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)
    slips: list[Literal["enter", "still", "back"]] = field(default_factory=lambda: ["enter", "still", "back"])

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        return self.hand.may_begin(at_the_arm=at_the_arm, yes=yes)

    def begin(self, task: Task) -> bool:
        return self.hand.begin(task)

    def finished(self) -> bool:
        return self.hand.finished()

    def watch(self, postures: Mapping[int, int]) -> None:
        self.hand.watch(postures)

    def show(self, text: str) -> None:
        self.told.append(text)

    def read_angle(
        self, joint: int, number: int, wait: Callable[[float], None]
    ) -> float | Literal["taken back"] | None:
        assert not (self.folder / "machine.toml").exists(), "written only when all is measured"
        self.asked.append(number)
        if number > 1 and self.slips:
            match self.slips.pop(0):
                case "enter":
                    return None
                case "still":
                    return 12.0
                case "back":
                    return "taken back"
        return self.hand.read_angle(joint, number, wait)


def test_an_early_enter_and_a_joint_that_was_not_moved_do_not_end_the_step(tmp_path: Path) -> None:
    with mock("") as arm:
        assert arm.control is not None
        with mock_operator(arm.control, load_machine("ma2000"), lambda _text: None, lock_step=True) as hand:
            person = Clumsy(hand, tmp_path)
            call = Invocation(port_option=f"{arm.url}?lock_step=1")
            bench = Bench(call, tmp_path, person, ConsentPrompt(True), Record.of(tmp_path), (1,), 5)
            found = potentiometers(bench)
    assert person.asked == [1, 2, 2, 2, 1, 2, 3, 4, 5]
    assert len(found["joint_1"]["counts"]) == 5
    assert any("1 postures, at least 5 are needed" in line for line in person.told)
    assert any("not counted; move it further" in line for line in person.told)
    assert (tmp_path / "machine.toml").exists()


# ---- the diagnosis asks for an experiment, so it is made by the method that proposes one


@pytest.mark.parametrize(("machine", "method"), [("single_axis.toml", "output-error"), ("ma2000", None)])
def test_the_loop_of_a_sampled_controller_is_simulated(
    machine: str, method: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[DiagnosisOptions] = []

    def diagnose(*given: Any, **_: Any) -> None:
        asked.append(given[3])
        raise SpecError("seen")

    monkeypatch.setattr(workflow, "diagnose", diagnose)
    begin = base_model(load_machine(str(EXAMPLES / machine) if machine.endswith(".toml") else machine))
    bench: Any = SimpleNamespace(operator=SimpleNamespace(show=lambda _line: None))
    with pytest.raises(SpecError, match="seen"):
        by_command._diagnosed(bench, begin, swinging(1))
    assert asked == [DiagnosisOptions(method=method)]
