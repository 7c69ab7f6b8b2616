"""What the host's own memory map leaves out is never asked for, even of a bridge that would carry it out."""

from collections.abc import Callable, Iterator

import pytest

from daq.driver import Controller
from daq.link import RequestRefusedError
from firmware_protocol.commands import Refusal
from firmware_protocol.memory_map import MemoryMap, default_memory_map
from tests.control_port import told_by

MOCK = "mock://?lock_step=1&seed=1"
"""Its bridge works by the map that ships, which has everything."""
GAINS, SIGNALS = ("gain_p", "gain_i", "gain_d"), ("process_outputs", "gripper")


def without(*absent: str) -> MemoryMap:
    whole = default_memory_map()
    kept = {name: register for name, register in whole.registers.items() if name not in absent}
    return MemoryMap.model_validate(dict(whole) | {"registers": kept})


@pytest.fixture
def bridge_with_everything() -> Iterator[Controller]:
    with Controller.connect(MOCK, without(*GAINS, *SIGNALS)) as controller:
        yield controller


ORDERS: dict[str, Callable[[Controller], object]] = {
    "SetGains": lambda controller: controller.set_gains(1, 7, 3, 1),
    "ReadProcess": Controller.process,
    "WriteOutputs": lambda controller: controller.write_outputs(0xFF, 0xA5),
    "SetGripper": lambda controller: controller.set_gripper(closed=True),
}


@pytest.mark.parametrize("request_name", ORDERS)
def test_what_the_map_leaves_out_is_refused_and_nothing_is_sent(
    bridge_with_everything: Controller, request_name: str
) -> None:
    controller = bridge_with_everything
    control = controller.link.control
    assert control is not None
    before, sent = told_by(control, "state"), controller.counters.numbers()
    with pytest.raises(RequestRefusedError, match=f"{request_name}: the memory map leaves out .* not sent") as refused:
        ORDERS[request_name](controller)
    assert refused.value.reason == Refusal.NOT_CAPABLE
    after = told_by(control, "state")
    assert (after, controller.counters.numbers()) == (before, sent)


def test_gains_that_the_map_leaves_out_are_not_known(bridge_with_everything: Controller) -> None:
    sent = bridge_with_everything.counters.numbers()
    assert bridge_with_everything.gains() == {}
    assert bridge_with_everything.counters.numbers() == sent


def test_a_map_that_leaves_out_the_gains_alone_leaves_the_gripper_usable() -> None:
    with Controller.connect(MOCK, without(*GAINS)) as controller:
        controller.set_gripper(closed=True)
        assert controller.process().gripper == 1
        with pytest.raises(RequestRefusedError):
            controller.set_gains(1, 7, 3, 1)
