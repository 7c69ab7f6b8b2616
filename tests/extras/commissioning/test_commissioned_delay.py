"""The step that measures the computing delay: whatever ends it early freezes the arm, and nothing moves it then."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.machine import load_machine
from daq.owner.stop_socket import request_stop
from daq.runner.arm_control import StoppedError
from daq.teaching.arm import TeachingError
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.bench import Bench
from extras.commissioning.command.delay import delay
from extras.commissioning.command.record import Record
from tests.daq_cli.board import ask
from tests.extras.commissioning.test_commission import Hand


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
