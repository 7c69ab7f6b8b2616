"""Memory maps that a seed draws."""

import pytest

from firmware_protocol.memory_map import default_memory_map
from mock_controller.hidden.memory import Documented, draw_memory
from tests.mock.host import make_device


@pytest.mark.parametrize("documented", ["kept", "moved"])
def test_every_seed_draws_a_valid_map_the_same_each_time(documented: Documented) -> None:
    for seed in range(40):
        memory = draw_memory(seed, documented)
        assert memory.truth() == draw_memory(seed, documented).truth()
        used = [address for register in memory.map.registers.values() for address in register.addresses]
        used += [address for other in memory.others for address in other.addresses]
        assert len(used) == len(set(used)) <= memory.map.size


def test_the_documented_six_are_kept_or_moved_as_asked() -> None:
    shipped = default_memory_map()["position"]
    assert shipped.high is not None
    documented = {*shipped.low[:3], *shipped.high[:3]}
    for seed in range(20):
        kept, moved = draw_memory(seed, "kept").map["position"], draw_memory(seed, "moved").map["position"]
        assert kept.low[:3] == shipped.low[:3]
        assert not documented & set(moved.addresses)


def test_a_bridge_that_believes_in_another_map_stops_the_arm_at_the_wrong_bytes() -> None:
    device = make_device(secret_map=4, documented="moved", lock_step=True)
    board = device.board
    board.run_until(100_000)
    before = board.memory.values("set_point")
    board.freeze()
    assert board.memory.values("set_point") == before or board.written == {}
    assert board.host_memory.map == default_memory_map()


def test_writes_are_counted_by_address() -> None:
    board = make_device(secret_map=4, lock_step=True).board
    board.write(0xFC10, b"\x01\x02")
    assert dict(board.written) == {0xFC10: 1, 0xFC11: 1}
