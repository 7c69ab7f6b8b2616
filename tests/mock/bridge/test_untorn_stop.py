"""What the contract's test of stops tells of a bridge that reads the posture once, and of one that reads it twice."""

import pytest

from daq.driver import Controller
from daq.link import Link
from mock_controller.bridge.bridge import Bridge
from mock_controller.bridge.routines import MemoryRoutines
from tests.contract.untorn_stop import NEAR, frozen_far_away
from tests.mock.in_process import InProcess


class _ReadsOnce(MemoryRoutines):
    """What a bridge does that has never heard of torn readings."""

    def freeze(self) -> tuple[int, ...]:
        return self._board.freeze(self._read_positions())


class NaiveBridge(Bridge):
    """Freezes whatever it reads."""

    routines = _ReadsOnce


@pytest.mark.parametrize(("kind", "torn"), [(NaiveBridge, True), (Bridge, False)], ids=["naive", "reads twice"])
def test_a_bridge_that_reads_the_posture_once_is_found_out(kind: type[Bridge], torn: bool) -> None:
    with Controller(Link(InProcess(kind))) as controller:
        assert (frozen_far_away(controller) > NEAR) is torn


def test_without_supply_there_is_nothing_to_read_and_the_freeze_holds() -> None:
    endpoint = InProcess(Bridge)
    with Controller(Link(endpoint)) as controller:
        before = endpoint.board.memory.values("set_point")
        endpoint.board.brown_out()
        assert controller.stop().acknowledged
        controller.clock.sleep_until(controller.clock.now() + 0.5)
        assert endpoint.board.frozen
        after = endpoint.board.memory.values("set_point")
    assert all(abs(one - other) <= 5 for one, other in zip(before, after, strict=True)), "not a posture of zeros"
