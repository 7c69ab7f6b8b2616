"""A stop of the core in C freezes the posture of now, and is answered, whatever the memory and the bus do."""

from collections.abc import Callable
from itertools import count, pairwise

import pytest

from firmware_protocol import commands as c
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import counts_to_posture
from tests.firmware.compiled import need
from tests.firmware.core import PeriodSource
from tests.firmware.machine import MAP, PERIOD_US, Machine, noisy, sweeping

ANSWERED_US = 10_000
"""PROTOCOL.md, section 3: a stop whose posture has to be read."""
OF_JOINT_1 = MAP["position"].low[0]
POWER_OF_JOINT_6 = MAP["power"].low[5]


@pytest.fixture(autouse=True)
def _compiler() -> None:
    need("gcc", "make")


def moving(tick: int) -> list[int]:
    """An arm of which every joint moves on by 10 counts a period."""
    return [1000 + 10 * tick] * JOINTS


def flickering(address: int, bit: int = 1) -> Callable[[int, int], int]:
    """A bus on which one bit of one byte is another at every reading."""
    turns = count()
    return lambda at, value: value ^ bit * (next(turns) & 1) if at == address else value


def tell(machine: Machine, periods: int) -> None:
    """Periods that a wire tells the bridge, each when its results have been stored."""
    machine.run(9_000 - machine.now_us % PERIOD_US)
    for _ in range(periods):
        machine.core.period_ended()
        machine.periods(1)


def postures_now(machine: Machine, back: int = 1) -> tuple[int, ...]:
    """The posture that was stored so many periods ago."""
    return tuple(counts_to_posture(position) for position, _, _ in machine.whole[-back])


CLOCK_ROUND_US = 1 << 32


def rising(tick: int) -> list[int]:
    """An arm that moves on for 1000 periods."""
    return [min(1000 + 2 * tick, 3000)] * JOINTS


@pytest.mark.parametrize("later_us", [3 * PERIOD_US, 10_000_000])
def test_a_wire_that_has_broken_leaves_no_old_posture_to_a_stop(later_us: int) -> None:
    machine = Machine(rising, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    machine.run(later_us)
    assert machine.ask(c.Stop(), ANSWERED_US).postures == postures_now(machine)


def test_a_snapshot_is_not_new_again_when_the_clock_has_gone_round() -> None:
    machine = Machine(rising, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    kept_us = machine.now_us
    machine.run(3 * PERIOD_US)
    machine.shift(kept_us + CLOCK_ROUND_US - machine.now_us)
    machine.now_us = kept_us + CLOCK_ROUND_US
    machine.run(PERIOD_US)
    assert machine.ask(c.Stop(), ANSWERED_US).postures == postures_now(machine)


def test_while_the_wire_tells_periods_a_stop_takes_the_newest_snapshot_at_once() -> None:
    machine = Machine(moving, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    assert machine.ask(c.Stop(), 500).postures == postures_now(machine, 2), "told last"


def test_a_bit_that_flickers_in_a_power_leaves_no_old_posture_to_a_stop() -> None:
    machine = Machine(moving)
    machine.greet()
    machine.periods(5)
    machine.on_the_bus = flickering(POWER_OF_JOINT_6)
    machine.periods(100)
    stopped = machine.ask(c.Stop(), ANSWERED_US)
    assert stopped.postures in (postures_now(machine), postures_now(machine, 2))


@pytest.mark.parametrize("source", [PeriodSource.WATCHED, PeriodSource.UNSEEN], ids=["SAMPLE", "no SAMPLE"])
@pytest.mark.parametrize("bit", [1, 0x80])
def test_a_bit_that_flickers_in_a_position_cannot_hold_a_stop_up(source: PeriodSource, bit: int) -> None:
    machine = Machine(noisy, source)
    machine.greet()
    machine.periods(5)
    machine.on_the_bus = flickering(OF_JOINT_1, bit)
    machine.periods(20)
    for moment in range(40):
        machine.run(500 * moment)
        stopped = machine.ask(c.Stop(), ANSWERED_US)
        assert all(abs(at - 500) <= 1 for at in stopped.postures[1:])
        assert abs(stopped.postures[0] - 500) <= 1 + bit // 4, "a reading that it has had"
        machine.release()


def test_of_joints_that_agree_at_some_time_the_agreed_reading_is_frozen() -> None:
    machine = Machine(noisy, PeriodSource.UNSEEN)
    machine.greet()
    machine.run(12_000)
    readings = {address: count() for address in MAP["position"].low}

    def bus(address: int, value: int) -> int:
        if address == OF_JOINT_1:
            return next(readings[address]) * 10  # never twice the same
        if address == MAP["position"].low[1]:
            return (100, 100, 200, 0)[min(next(readings[address]), 3)]
        return value

    machine.on_the_bus = bus
    stopped = machine.ask(c.Stop(), ANSWERED_US)
    assert stopped.postures[:2] == (counts_to_posture(2048 + 30), counts_to_posture(2048 + 100))


def test_a_period_that_cannot_be_read_costs_that_sample_and_no_other() -> None:
    machine = Machine(sweeping)
    machine.periods(5)
    seen = machine.ask(c.Sample(c.AFTER_NEWEST, 1)).tick
    machine.periods(6)
    machine.on_the_bus = flickering(POWER_OF_JOINT_6)
    machine.periods(2)
    machine.on_the_bus = lambda _address, value: value
    machine.periods(6)
    ticks = []
    for _ in range(12):
        seen = machine.ask(c.Sample(seen, 1)).tick
        ticks.append(seen)
    assert ticks[0] == ticks[5] - 5, "from before the gap"
    gaps = sorted(later - earlier for earlier, later in pairwise(ticks))
    assert gaps[:-1] == [1] * 10
    assert gaps[-1] in (2, 3)
