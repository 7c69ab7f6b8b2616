"""The mock bench as the maker's own client sees it."""

from typing import Any

import pytest
from dynamixel_sdk import GroupBulkRead, GroupSyncRead, GroupSyncWrite

from firmware_protocol.dynamixel.control_table import HardwareError
from mock_controller.servos.bench import Bench, Options
from tests.mock.servos.makers_client import MemoryPort, client

OK = (0, 0)
"""Result of the communication, and error of the servo."""
TORQUE, GOAL, PRESENT, P_GAIN, MODE, WATCHDOG = 64, 116, 132, 84, 11, 98
DATA_RANGE, ACCESS, ALERT, TIMEOUT = 4, 7, 0x80, -3001


class At:
    """A bench, the maker's client, and the port between them."""

    def __init__(self) -> None:
        self.bench = Bench(Options())
        self.port = MemoryPort(self.bench.receive)
        self.client: Any = client()

    def later(self, seconds: float) -> None:
        self.bench.advance_to(self.bench.time_us + round(seconds * 1e6))

    def read(self, device: int, address: int, size: int) -> int:
        value, *result = getattr(self.client, f"read{size}ByteTxRx")(self.port, device, address)
        assert tuple(result) == OK
        return int(value)

    def write(self, device: int, address: int, size: int, value: int) -> tuple[int, int]:
        result, error = getattr(self.client, f"write{size}ByteTxRx")(self.port, device, address, value)
        return result, error


@pytest.fixture
def at() -> At:
    return At()


def test_pings_tell_model_and_firmware(at: At) -> None:
    model, *result = at.client.ping(at.port, 1)
    assert (model, tuple(result)) == (1020, OK)
    everybody, result_of_all = at.client.broadcastPing(at.port)
    assert result_of_all == 0
    assert everybody == {1: [1020, 45], 2: [1020, 45]}
    assert at.client.ping(at.port, 7)[1] == TIMEOUT


def test_a_servo_turns_to_its_goal_once_its_torque_is_on(at: At) -> None:
    start = at.read(1, PRESENT, 4)
    assert at.write(1, GOAL, 4, start + 200) == OK
    at.later(0.5)
    assert at.read(1, PRESENT, 4) == start
    assert at.write(1, TORQUE, 1, 1) == OK
    at.later(1.0)
    assert abs(at.read(1, PRESENT, 4) - (start + 200)) < 10


def test_sync_writes_and_sync_reads_reach_both_servos(at: At) -> None:
    for device in (1, 2):
        assert at.write(device, TORQUE, 1, 1) == OK
    goals = {1: 2100, 2: 1700}
    writer = GroupSyncWrite(at.port, at.client, GOAL, 4)
    for device, goal in goals.items():
        assert writer.addParam(device, list(goal.to_bytes(4, "little")))
    assert writer.txPacket() == 0
    at.later(1.5)
    reader = GroupSyncRead(at.port, at.client, PRESENT, 4)
    for device in goals:
        assert reader.addParam(device)
    assert reader.txRxPacket() == 0
    assert all(abs(reader.getData(device, PRESENT, 4) - goal) < 12 for device, goal in goals.items())


def test_a_bulk_read_asks_each_servo_for_something_else(at: At) -> None:
    reader = GroupBulkRead(at.port, at.client)
    assert reader.addParam(1, 144, 2)
    assert reader.addParam(2, 146, 1)
    assert reader.txRxPacket() == 0
    assert (reader.getData(1, 144, 2), reader.getData(2, 146, 1)) == (120, 30)


def test_reg_write_waits_for_its_action(at: At) -> None:
    assert at.client.regWriteTxRx(at.port, 1, P_GAIN, 2, [0x90, 0x01]) == OK
    assert at.read(1, P_GAIN, 2) == 800
    assert at.client.action(at.port, 1) == 0
    assert at.read(1, P_GAIN, 2) == 400


def test_settings_are_locked_while_the_torque_is_on(at: At) -> None:
    assert at.write(1, TORQUE, 1, 1) == OK
    assert at.write(1, MODE, 1, 4) == (0, ACCESS)
    assert at.write(1, PRESENT, 4, 0) == (0, ACCESS)
    assert at.write(1, GOAL, 4, 5000) == (0, DATA_RANGE)


def test_a_hardware_error_switches_the_torque_off_and_rings_until_a_reboot(at: At) -> None:
    assert at.write(2, TORQUE, 1, 1) == OK
    at.bench.fail(2, HardwareError.OVERLOAD)
    value, result, error = at.client.read1ByteTxRx(at.port, 2, TORQUE)
    assert (value, result, error) == (0, 0, ALERT)
    assert at.write(2, TORQUE, 1, 1) == (0, ALERT | 1)
    assert at.client.reboot(at.port, 2)[0] == 0
    assert at.write(2, TORQUE, 1, 1) == OK


def test_a_silent_bus_stops_a_servo_that_watches_it_until_the_watch_is_ended(at: At) -> None:
    start = at.read(1, PRESENT, 4)
    for address, size, value in ((WATCHDOG, 1, 5), (TORQUE, 1, 1), (GOAL, 4, start + 900)):
        assert at.write(1, address, size, value) == OK
    at.later(0.2)
    held = at.read(1, PRESENT, 4)
    assert at.read(1, WATCHDOG, 1) == 0xFF
    assert start < held < start + 500
    assert at.write(1, GOAL, 4, start) == (0, DATA_RANGE)
    assert at.write(1, WATCHDOG, 1, 0) == OK
    assert at.write(1, GOAL, 4, start) == OK


def test_a_servo_off_the_bus_is_silent_and_the_other_answers(at: At) -> None:
    at.bench.gone.add(2)
    assert at.client.ping(at.port, 2)[1] == TIMEOUT
    assert at.read(1, GOAL, 4) == at.read(1, PRESENT, 4)


def test_the_bar_falls_when_the_torque_goes_off_under_a_load(at: At) -> None:
    bench = Bench(Options(load=0.5, torque=True))
    bench.advance_to(500_000)
    held = bench.angles()[1]
    bench.receive(b"")
    MemoryPort(bench.receive).writePort([])
    at.client.write1ByteTxRx(MemoryPort(bench.receive), 2, TORQUE, 0)
    bench.advance_to(1_500_000)
    assert bench.angles()[1] < held - 0.1
