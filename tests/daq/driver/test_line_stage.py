"""The small dialect of the examples: a stage of sliding axes that speaks lines of text, under driver, runner, models.

The stage is that of the example's rig, which shares no code with them; its time passes as the host waits.
"""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.experiment import ExperimentSpec, Multisine
from daq.contracts.machine import load_machine
from daq.driver import Controller
from daq.link import Link, LinkTimeoutError, RequestRefusedError
from daq.traces.reader import read_trace
from firmware_protocol.commands import Capability, FineSetPoints, Hello, Sample, StatusFlag, Stop
from model.machine_model.model import base_model
from model.simulation.simulate import simulate
from tests.daq.servo_bench import InMemory, run_at

EXAMPLES = Path(__file__).parents[3] / "examples"
COUNT = 50e-6


def example(name: str) -> ModuleType:
    spec = spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    made = module_from_spec(spec)
    sys.modules[name] = made  # where dataclasses look for their module
    spec.loader.exec_module(made)
    return made


DIALECT, RIG = example("line_stage_dialect"), example("line_stage_rig")


class Line(InMemory):
    """The stage in memory."""

    def __init__(self) -> None:
        super().__init__()
        self.stage = RIG.Stage()
        self.us = 0
        self.written: list[bytes] = []
        self._rest = b""

    def now(self) -> float:
        return self.us * 1e-6

    def sleep_until(self, time_s: float) -> None:
        self.us = max(self.us, round(time_s * 1e6))
        self.stage.advance_to(self.us // 1000)

    def write(self, data: bytes) -> None:
        self.written.append(data)
        *lines, self._rest = (self._rest + self.hearing(data)).split(b"\r")
        self._coming += b"".join(self.stage.obey(line) + b"\r" for line in lines)

    def controller(self) -> Controller:
        dialect: Any = DIALECT.LineStageDialect((1, 2))
        return Controller(Link(self, dialect, self.now), clock=self)

    def goals(self) -> list[int]:
        return [axis.goal for axis in self.stage.axes]


@pytest.fixture
def line() -> Line:
    return Line()


@pytest.fixture
def controller(line: Line) -> Controller:
    """A connection to a stage that runs."""
    made = line.controller()
    made.release(made.status().stop)
    return made


def test_connecting_writes_nothing_and_set_points_wait_for_drives_that_come_on_still(line: Line) -> None:
    with line.controller() as controller:
        assert controller.identity.simulated
        assert StatusFlag.NO_TORQUE in controller.status().flags
        assert controller.next_snapshot()[1].position == 2000
        assert controller.gains() == {1: (2, 0, 0), 2: (2, 0, 0)}
    assert set(b"".join(line.written).split(b"\r")) == {b"V?", b"P?", b""}
    with line.controller() as controller, pytest.raises(RequestRefusedError, match="its drives are off"):
        controller.set_points({1: 2100})
    assert line.goals() == [2000, 2000]
    line.stage.axes[0].place += 0.01  # pushed by hand while the drives were off
    line.sleep_until(0.01)
    with line.controller() as controller:
        controller.release(controller.status().stop)
        line.sleep_until(line.now() + 0.2)
    assert line.stage.axes[0].encoder() == 2200


def test_set_points_are_goals_and_samples_come_every_twentieth_tick(controller: Controller, line: Line) -> None:
    controller.set_points({1: 2100, 2: 1900})
    assert line.goals() == [2100, 1900]
    assert controller.next_snapshot().set_points == {1: 2100, 2: 1900}
    ticks = [controller.next_snapshot().tick]
    for _ in range(20):
        ticks.append(controller.next_snapshot(ticks[-1] + 19).tick)
    assert {later - earlier for earlier, later in pairwise(ticks)} <= {19, 20, 21}


def test_a_stop_holds_for_whoever_comes_next_and_no_repeat_undoes_it(controller: Controller, line: Line) -> None:
    # A stop holds and whoever comes next finds it
    controller.set_points({1: 3000})
    line.sleep_until(line.now() + 0.05)
    stopped = controller.stop()
    assert stopped.acknowledged
    assert list(stopped.frozen.values()) == line.goals()
    with pytest.raises(RequestRefusedError, match="is halted until it is released"):
        controller.set_points({1: 3000})
    controller.close()
    with line.controller() as other:
        assert StatusFlag.FROZEN in other.status().flags
        other.release(other.status().stop)
        assert StatusFlag.FROZEN not in other.status().flags
    # A repeat of set points cannot undo a stop
    dialect = DIALECT.LineStageDialect((1, 2))
    late = FineSetPoints(((1, 2600),), 4096)
    frame = dialect.encode(7, late)
    assert dialect.again(late, frame) == frame
    dialect.encode(8, Stop())
    assert dialect.again(late, frame) == b"P?\r"


def test_a_stop_of_another_host_is_seen_and_its_release_is_not_ours(controller: Controller, line: Line) -> None:
    before = controller.status().stop
    line.stage.obey(b"H")
    assert StatusFlag.FROZEN in controller.status().flags
    with pytest.raises(RequestRefusedError, match="is newer than the one to be ended"):
        controller.release(before)
    assert line.stage.state == "H"


def test_commands_that_are_lost_are_made_good(controller: Controller, line: Line) -> None:
    lost: list[bytes] = []

    def hearing(data: bytes) -> bytes:
        if len(lost) < 2 and data != b"P?\r":
            lost.append(data)
            return b""
        return data

    line.hearing = hearing
    controller.set_points({2: 1800})
    assert line.goals() == [2000, 1800]
    lost.clear()
    assert controller.stop().acknowledged
    lost.clear()
    controller.release(controller.status().stop)
    assert line.stage.state == "R"


def test_a_silent_stage_is_told_and_what_was_said_before_does_not_count(line: Line) -> None:
    dialect = DIALECT.LineStageDialect((1, 2))
    dialect.encode(1, Hello(2, 1))
    ((number, reply),) = dialect.feed(b"V STAGE 2 SIM\rP 5 R 1 1 0 2 2 0\r")
    assert (number, Capability.SIMULATED in Capability(reply.capabilities)) == (1, True)
    dialect.encode(2, Hello(2, 2))
    assert dialect.feed(b"P 6 R 1 1 0 2 2 0\r") == [], "a late answer to an earlier question"
    ((number, reply),) = dialect.feed(b"V STAGE 2 HW\rP 7 R 1 1 0 2 2 0\r")
    assert (number, Capability.SIMULATED in Capability(reply.capabilities)) == (2, False)
    line.hearing = lambda _: b""
    with pytest.raises(LinkTimeoutError, match="no reply to Hello"):
        line.controller()


@given(
    st.lists(
        st.binary(max_size=60) | st.sampled_from([b"P 5 R 1 2 3 4 5 6\r", b"V STAGE 2 SIM\r", b"OK\r"]), max_size=12
    )
)
def test_no_bytes_raise_anything(pieces: list[bytes]) -> None:
    dialect = DIALECT.LineStageDialect((1, 2))
    for number, request in enumerate((Hello(2, 1), Sample(1, 3), Stop())):
        dialect.encode(number, request)
    for piece in pieces:
        dialect.feed(piece)
        dialect.answer()


def test_a_record_of_the_stage_is_what_its_model_does(line: Line, tmp_path: Path) -> None:
    machine = load_machine(str(EXAMPLES / "line_stage.toml"))
    trajectory = Multisine(amplitude={1: 0.03, 2: 0.02}, duration=4.0, lowest=0.2, highest=1.5, tones=6, seed=1)
    spec = ExperimentSpec(trajectory=trajectory, joints=(1, 2), settle=0.3, hold=0.3)
    with line.controller() as controller:
        controller.release(controller.status().stop)
        result = run_at(controller, spec, machine, tmp_path)
    assert (result.outcome, result.missing) == ("complete", 0)
    trace = read_trace(result.trace)
    simulation = simulate(base_model(machine), trace)
    apart = simulation.at_samples(simulation.reading) - trace.position
    speed = simulation.at_samples(simulation.velocity)
    assert np.sqrt(np.mean(apart**2, axis=0)).max() < 0.5 * COUNT
    assert np.abs(np.sum(apart * speed, axis=0) / np.sum(speed**2, axis=0)).max() < 2e-4  # s ahead of the record
