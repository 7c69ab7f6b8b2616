"""Whether a controller is the one that was commissioned, against memories that the mock draws."""

import pytest

from extras.commissioning.command.arm import (
    Identity,
    same_adapter,
    same_bytes,
    same_period,
    same_registers,
    without_registers,
)
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board.board import Board
from tests.mock.host import make_device

KEPT = Identity({0xFC70 + k: k for k in range(10)}, 20.0, 0.001, "A1")


def board(seed: int, minutes: float = 0.0) -> Board:
    """A controller with a secret memory, some time after it was switched on."""
    device = make_device(secret_map=seed, lock_step=True).board
    device.run_until(200_000 + round(60e6 * minutes))
    return device


def page(of: Board) -> bytes:
    return of.memory.block(of.memory.map.base, of.memory.map.size)


def test_the_same_controller_is_known_again_after_a_long_time_and_another_one_is_not() -> None:
    for seed in range(2):
        begun = board(seed)
        pages = [page(begun)]
        for _ in range(200):
            begun.run_until(begun.time_us + 20_000)
            pages.append(page(begun))
        base = begun.memory.map.base
        still = {base + k: pages[0][k] for k in range(len(pages[0])) if len({one[k] for one in pages}) == 1}
        known = Identity(without_registers(still, begun.memory.map))
        begun.run_until(begun.time_us + 2_000_000)
        left, why = same_bytes(known, base, [page(begun)])
        assert why == ""
        assert set(left.constants) <= set(known.constants)
        assert "bytes that nothing changed are others" in same_bytes(known, base, [page(board(seed + 100))])[1]


def test_bytes_of_registers_identify_nobody() -> None:
    taken = default_memory_map()["gain_p"].low[0]
    assert without_registers({taken: 2, 0xFC7F: 9}, default_memory_map()) == {0xFC7F: 9}


def test_a_byte_that_changed_after_all_is_forgotten() -> None:
    data = bytearray(range(256))
    data[0x70:0x7A] = bytes(range(10))
    data[0x71] = 200
    left, why = same_bytes(KEPT, 0xFC00, [bytes(data)])
    assert why == ""
    assert 0xFC71 not in left.constants
    assert len(left.constants) == 9


def test_registers_that_do_not_hold_together_are_others() -> None:
    assert same_registers({1: 500, 2: 250}, {1: 2040, 2: 1030}, {1: 8, 2: -6}) == ""
    assert same_registers({1: 500, 2: 250}, {1: 2040, 2: 3000}, {1: 8, 2: -6}).endswith("at joint 2")
    assert same_registers({1: 1200, 2: 5}, {1: 0, 2: 900}, {1: 0, 2: 0}).endswith("at joints 1, 2")


@pytest.mark.parametrize(
    ("period", "error", "other"), [(20.01, 0.0, False), (20.05, 0.001, True), (20.05, 0.02, False)]
)
def test_another_period_is_another_controller_only_beyond_what_crystals_and_the_measurement_allow(
    period: float, error: float, other: bool
) -> None:
    assert bool(same_period(KEPT, period, error)) is other
    assert same_period(Identity({}), period, error) == ""


def test_an_adapter_is_compared_only_where_both_have_a_serial_number() -> None:
    assert same_adapter(KEPT, "A1") == same_adapter(KEPT, None) == same_adapter(Identity({}), "A2") == ""
    assert "A2" in same_adapter(KEPT, "A2")


def test_an_identity_is_the_same_after_it_was_written_and_read() -> None:
    assert Identity.of_data(KEPT.as_data()) == KEPT
    assert Identity.of_data({}) == Identity({})
