"""The mock bench as the maker's own client sees it, and its secret effects."""

import json
import math
from typing import Any

import pytest
from dynamixel_sdk import GroupBulkRead, GroupSyncRead, GroupSyncWrite

from firmware_protocol.dynamixel.control_table import HardwareError
from mock_controller.reveal import main as reveal
from mock_controller.servos.__main__ import main as start
from mock_controller.servos.bench import Bench, Options
from mock_controller.servos.plant import NONE, Head, Motor, PanTilt, Secret, draw_secret
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


def test_a_bulk_read_asks_each_for_something_else_and_a_reg_write_waits(at: At) -> None:
    reader = GroupBulkRead(at.port, at.client)
    assert reader.addParam(1, 144, 2)
    assert reader.addParam(2, 146, 1)
    assert reader.txRxPacket() == 0
    assert (reader.getData(1, 144, 2), reader.getData(2, 146, 1)) == (120, 30)
    assert at.client.regWriteTxRx(at.port, 1, P_GAIN, 2, [0x90, 0x01]) == OK
    assert at.read(1, P_GAIN, 2) == 800
    assert at.client.action(at.port, 1) == 0
    assert at.read(1, P_GAIN, 2) == 400
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


# ---- Secret effects of the bench of servos

SMOOTH = Motor(coulomb=0.0)


def after(secret: Secret, volts: tuple[float, float], motor: Motor = SMOOTH, seconds: float = 0.5) -> PanTilt:
    """A head that begins level, after some time with voltages at its motors."""
    head = PanTilt(Head(), motor, secret=secret)
    head.volts = [*volts]
    for _ in range(round(seconds / 250e-6)):
        head.step()
    return head


def test_a_seed_hides_one_effect_that_reveal_tells(capsys: pytest.CaptureFixture[str]) -> None:
    # A seed hides one effect and reveal tells it
    assert reveal(["--servos", "4", "5"]) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["seed"] for one in told] == [4, 5]
    for one in told:
        secret, (effect,) = draw_secret(one["seed"]), one["effects"]
        assert (effect["effect"], effect["joint"], effect["size"]) == (secret.effect, secret.joint, secret.size)
    assert {draw_secret(seed).effect for seed in range(60)} == {
        "payload",
        "coulomb_friction",
        "viscous_friction",
        "direction_dependent_friction",
        "dead_zone",
        "spring_torque",
    }
    # A seed without a meaning is one line
    assert reveal(["--servos", "-1"]) == 2
    assert start(["--secret", "-1"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert all("secret -1: a whole number from 0 on is allowed" in line for line in lines)


def test_friction_of_one_direction_slows_forwards() -> None:
    secret, motor = Secret("direction_dependent_friction", 1, 0.1), Motor(coulomb=0.1)
    forwards, backwards = (after(secret, (volts, 0.0), motor).position[0] for volts in (2.0, -2.0))
    sound = after(NONE, (2.0, 0.0), motor).position[0]
    assert forwards < sound < -backwards
    assert math.isclose(forwards - backwards, 2 * sound, rel_tol=0.01)


@pytest.mark.parametrize("joint", [1, 2])
def test_frictions_act_on_their_own_joint_as_their_names_say(joint: int) -> None:
    k, volts = joint - 1, (3.0, 6.0)
    sound = after(NONE, volts)
    slowed = after(Secret("viscous_friction", joint, 0.5), volts)
    assert 0.0 < slowed.speed[k] < 0.8 * sound.speed[k]
    rubbing = after(Secret("coulomb_friction", joint, 0.3), volts)
    more = after(NONE, volts, Motor(coulomb=0.3))
    assert rubbing.position[k] == pytest.approx(more.position[k], rel=0.05)
