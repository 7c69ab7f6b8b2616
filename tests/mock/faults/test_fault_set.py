"""Switching on and off, spans of time, labels, seeds."""

import pytest

from firmware_protocol.commands import Advance, ReadStatus
from mock_controller.faults.fault import FaultError
from tests.mock.host import LockStepHost, make_device


def answered(host: LockStepHost, number: int) -> bool:
    return bool(host.replies(ReadStatus(), number))


def test_a_fault_acts_from_its_start_for_its_duration() -> None:
    host = LockStepHost(fault=("drop:direction=to_host,start=0.1,duration=0.05",))
    lost = []
    for number in range(20):
        lost.append(not answered(host, number))
        host.board.run_until(host.board.time_us + 10_000)
    assert lost == [False] * 10 + [True] * 5 + [False] * 5


def test_what_is_over_is_no_longer_listed() -> None:
    host = LockStepHost(fault=("drop:rate=0,duration=0.1", "flip:rate=0"))
    assert [entry["label"] for entry in host.device.faults.listing()] == ["drop", "flip"]
    host.ask(Advance(200_000))
    assert [entry["label"] for entry in host.device.faults.listing()] == ["flip"]


def test_faults_of_one_name_have_labels_of_their_own() -> None:
    faults = make_device().faults
    labels = [faults.switch_on(f"stuck_potentiometer:joint={joint}").label for joint in (1, 2, 3)]
    assert labels == ["stuck_potentiometer", "stuck_potentiometer#2", "stuck_potentiometer#3"]
    assert faults.switch_off("stuck_potentiometer#2") == ["stuck_potentiometer#2"]
    assert faults.switch_off("stuck_potentiometer") == ["stuck_potentiometer", "stuck_potentiometer#3"]
    with pytest.raises(FaultError, match="is not switched on; switched on are: none"):
        faults.switch_off("stuck_potentiometer")


def test_each_fault_draws_from_its_own_numbers() -> None:
    def losses(*faults: str, seed: int = 0) -> list[bool]:
        host = LockStepHost(fault=faults, seed=seed)
        return [not answered(host, number) for number in range(60)]

    alone = losses("drop:rate=0.3,direction=to_host")
    assert losses("drop:rate=0.3,direction=to_host", "busy_memory:rate=0.5") == alone
    assert losses("drop:rate=0.3,direction=to_host", seed=1) != alone
    own = losses("drop:rate=0.3,direction=to_host,seed=5")
    assert losses("drop:rate=0.3,direction=to_host,seed=5", seed=1) == own
