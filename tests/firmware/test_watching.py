"""The core in C watches the memory for the controller's periods, and neither reads nor writes what a map leaves out."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.limp import GAINS_UNKNOWN
from daq.driver import Controller
from daq.link import RequestRefusedError
from firmware_protocol import commands as c
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import GAIN_REGISTERS, default_memory_map, memory_map_text, parse_memory_map
from firmware_protocol.units import counts_to_posture
from mock_controller.hidden.memory import draw_memory
from tests.control_port import told_by
from tests.daq.runner.rig import SHORT, rig
from tests.firmware.compiled import need
from tests.firmware.core import PeriodSource
from tests.firmware.machine import PERIOD_US, Machine, noisy, still, sweeping
from tests.firmware.process import served

ALL = 0x3F


@pytest.fixture(autouse=True)
def _compiler() -> None:
    need("gcc", "make")


def readings(snapshot: c.Snapshot) -> list[tuple[int, int, int]]:
    """What a snapshot has of positions, errors and powers."""
    return [(reading.position, reading.error, reading.power) for _, reading in snapshot.joints]


def sampled(machine: Machine, count: int) -> list[c.Snapshot]:
    """So many snapshots, one after the other."""
    snapshots = [machine.ask(c.Sample(c.AFTER_NEWEST, ALL))]
    while len(snapshots) < count:
        snapshots.append(machine.ask(c.Sample(snapshots[-1].tick, ALL)))
    return snapshots


@pytest.mark.parametrize("drift", [0.0, 0.008, -0.008], ids=["same clock", "controller slower", "controller faster"])
def test_every_period_is_found_with_clocks_that_differ(drift: float) -> None:
    machine = Machine(sweeping, drift=drift)
    machine.run(3 * PERIOD_US)
    snapshots = sampled(machine, 60)
    ahead = snapshots[0].tick - 1 - machine.whole.index(readings(snapshots[0]))
    for earlier, snapshot in pairwise(snapshots):
        assert snapshot.tick == earlier.tick + 1
        assert readings(snapshot) == machine.whole[snapshot.tick - 1 - ahead], "whole, and of its own period"


@pytest.mark.parametrize("shift_us", [3_000, 9_000, 15_000])
def test_a_controller_that_changes_its_phase_is_never_read_torn_and_followed_again(shift_us: int) -> None:
    machine = Machine(sweeping)
    machine.periods(4)
    machine.shift(shift_us)
    snapshots = sampled(machine, 60)
    assert all(readings(snapshot) in machine.whole for snapshot in snapshots)
    ticks = [snapshot.tick for snapshot in snapshots[-10:]]
    assert ticks == list(range(ticks[0], ticks[0] + 10))
    assert machine.whole.index(readings(snapshots[-1])) >= len(machine.whole) - 2, "as fresh as before"


def test_set_points_written_at_any_moment_are_taken_in_the_period_that_was_told() -> None:
    machine = Machine(noisy)
    machine.greet()
    machine.periods(3)
    for step in range(40):
        machine.run(step * PERIOD_US // 40)
        taken = machine.ask(c.WriteSetPoints(((1, 400 + step), (2, 600 - step))))
        snapshot = machine.ask(c.Sample(taken.tick, 0b11))
        assert snapshot.tick == taken.tick + 1
        assert [reading.set_point for _, reading in snapshot.joints] == [400 + step, 600 - step]
        assert not snapshot.status & c.StatusFlag.SET_POINT_MISSED
    assert machine.ask(c.ReadStatus()).missed == 0


def test_a_set_point_that_the_controller_missed_is_told() -> None:
    machine = Machine(noisy)
    machine.greet()
    machine.periods(3)
    machine.misses_fetches = True
    taken = machine.ask(c.WriteSetPoints(((1, 510),)))
    snapshot = machine.ask(c.Sample(taken.tick, 1))
    assert snapshot.status & c.StatusFlag.SET_POINT_MISSED
    assert snapshot.joints[0][1].set_point == 500, "what the controller went on with"
    machine.misses_fetches = False
    later = machine.ask(c.Sample(snapshot.tick + 1, 1))
    assert not later.status & c.StatusFlag.SET_POINT_MISSED
    assert later.joints[0][1].set_point == 510
    assert machine.ask(c.ReadStatus()).missed >= 1


def test_an_arm_without_noise_is_counted_on_for_25_periods_and_then_nothing_is_new() -> None:
    machine = Machine(sweeping)
    machine.periods(3)
    before = sampled(machine, 2)[-1]
    machine.positions = still
    snapshots = sampled(machine, 20)
    assert snapshots[-1].tick == snapshots[0].tick + 19
    assert snapshots[0].tick > before.tick
    machine.periods(30)
    reply = machine.ask(c.Sample(c.AFTER_NEWEST, 1), 30 * PERIOD_US)
    assert reply == c.Refused(c.Sample.OPCODE, c.Refusal.NOTHING_NEW)


def test_a_host_that_was_away_gets_what_the_ring_holds_the_oldest_first() -> None:
    machine = Machine(noisy)
    machine.periods(3)
    seen = sampled(machine, 1)[0].tick
    machine.periods(45)
    snapshot = machine.ask(c.Sample(seen, 1))
    newest = machine.ask(c.ReadStatus()).tick
    assert snapshot.tick > seen + 1, "what is lost shows as a gap"
    assert newest - snapshot.tick in (31, 32)
    assert machine.ask(c.Sample(snapshot.tick, 1)).tick == snapshot.tick + 1


@pytest.mark.parametrize("source", [PeriodSource.WATCHED, PeriodSource.UNSEEN], ids=["SAMPLE", "no SAMPLE"])
def test_a_stop_freezes_a_whole_posture_also_while_one_is_stored(source: PeriodSource) -> None:
    machine = Machine(sweeping, source)
    machine.greet()
    machine.periods(3)
    for moment in range(30):
        machine.run(5_900 + 20 * moment)
        stopped = machine.ask(c.Stop(), 12_000)
        postures = [tuple(counts_to_posture(position) for position, _, _ in result) for result in machine.whole[-4:]]
        assert stopped.postures in postures
        machine.release()
        machine.run(PERIOD_US - machine.now_us % PERIOD_US)


def test_a_freeze_that_the_bridge_starts_with_holds_and_has_a_number() -> None:
    machine = Machine(noisy)
    machine.core.start(0x00050000, frozen=True)
    machine.greet()
    refused = machine.ask(c.WriteSetPoints(((1, 400),)))
    assert refused == c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.FROZEN)
    assert machine.ask(c.ReadStatus()).stop > 0x00050000
    machine.release()
    assert isinstance(machine.ask(c.WriteSetPoints(((1, 400),))), c.SetPointsTaken)


def test_a_board_that_lost_its_supply_is_told_and_counted_from_1() -> None:
    machine = Machine(noisy)
    machine.greet()
    machine.periods(4)
    boots = machine.ask(c.ReadStatus()).boots
    machine.lose_supply()
    machine.periods(5)
    machine.power_up()
    machine.run(1_500)
    status = machine.ask(c.ReadStatus())
    assert status.status == c.StatusFlag.RESTARTED
    assert status.boots == boots + 1
    assert machine.ask(c.WriteSetPoints(((1, 400),))) == c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.BAD_SESSION)
    assert 1 <= machine.ask(c.Sample(0, 1)).tick <= 2


# ---- What a memory map leaves out is neither read nor written, by the mock's bridge and by that in C

SEED = 7


def without(folder: Path, *absent: str) -> Path:
    """The true map of a secret memory without some registers, as a file."""
    whole = draw_memory(SEED, "kept").map
    left = {name: register for name, register in whole.registers.items() if name not in absent}
    path = folder / "partial.toml"
    path.write_text(memory_map_text(whole.model_copy(update={"registers": left, "name": "partial"})), "utf-8")
    return path


@contextmanager
def controller(bridge: str, memory_map: Path) -> Iterator[tuple[Controller, str]]:
    """The controller behind a bridge that works by this map, and its control port."""
    if bridge == "mock":
        with Controller.connect(f"mock://?lock_step=1&seed=1&secret_map={SEED}&memory_map={memory_map}") as found:
            assert found.link.control is not None
            yield found, found.link.control
        return
    with served(bridge, "--secret-map", str(SEED), "--memory-map", str(memory_map)) as process:
        assert process.control is not None
        with Controller.connect(process.url) as found:
            yield found, process.control


@pytest.mark.parametrize("bridge", ["mock", "hosted"])
def test_without_gains_and_gripper_the_bridge_refuses_them_and_writes_nothing(bridge: str, tmp_path: Path) -> None:
    with controller(bridge, without(tmp_path, *GAIN_REGISTERS, "gripper")) as (robot, control):
        assert robot.gains() == {}
        for refused in (
            lambda: robot.set_gains(1, 2, 0, 0),
            robot.process,
            lambda: robot.write_outputs(1, 1),
            lambda: robot.set_gripper(closed=True),
        ):
            with pytest.raises(RequestRefusedError, match="memory map lacks the registers"):
                refused()
        assert set(robot.errors_positions_powers()) == {1, 2, 3, 4, 5, 6}
        assert told_by(control, "written")["written"] == {}


def test_an_arm_without_gains_runs_and_its_record_has_none(tmp_path: Path) -> None:
    path = without(tmp_path, *GAIN_REGISTERS)
    with rig(tmp_path, f"seed=1&secret_map={SEED}&memory_map={path}") as arm:
        result = arm.run()
        assert result.outcome == "complete"
        trace = arm.trace(result)
        assert trace.record.gains is None
        assert GAINS_UNKNOWN in [event.message for event in trace.events if event.kind == "note"]
        with pytest.raises(SafetyError, match="has no gains"):
            arm.run(SHORT.model_copy(update={"gains": {1: (3, 0, 0)}}))


def test_a_map_without_one_of_the_gains_or_without_a_set_point_is_none() -> None:
    whole = default_memory_map()
    for absent, says in (("gain_d", "give all of gain_p, gain_i, gain_d"), ("set_point", "set_point is missing")):
        left = {name: register for name, register in whole.registers.items() if name != absent}
        text = memory_map_text(whole.model_copy(update={"registers": left}))
        with pytest.raises(MemoryMapError, match=says):
            parse_memory_map(text)
