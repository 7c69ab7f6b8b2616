"""The control of the robot, with a clock turned by hand."""

import queue
from collections.abc import Iterator
from contextlib import closing

import pytest

from server.problems import ProblemError
from server.robot.control import LEASE_TIME, ControlService
from tests.server.clocks import HandClock

WITHIN = 60.0
"""s after which a test has failed."""


@pytest.fixture
def lapsed() -> queue.Queue[str]:
    """Who went silent."""
    return queue.Queue()


@pytest.fixture
def clock() -> HandClock:
    """Stands still until it is turned."""
    return HandClock()


@pytest.fixture
def control(clock: HandClock, lapsed: queue.Queue[str]) -> Iterator[ControlService]:
    """Nobody has the control."""
    made = ControlService(clock, lapsed.put)
    yield made
    made.close()


def test_a_heartbeat_keeps_the_control_and_silence_ends_it_by_no_wall_clock(
    control: ControlService, clock: HandClock
) -> None:
    lease = control.take("anna", moves_real_arm=False).lease
    clock.wall = clock.wall.replace(year=2030)
    assert control.require(lease).name == "anna"
    for _ in range(5):
        clock.turn(LEASE_TIME - 1)
        control.renew(lease)
    clock.turn(LEASE_TIME)
    with pytest.raises(ProblemError, match=r"lost control|no longer"):
        control.require(lease)
    assert control.status().holder == "nobody"
    assert control.take("bert", moves_real_arm=False).lease != lease


def test_the_queue_and_a_client_never_have_it_together(control: ControlService) -> None:
    lease = control.take("anna", moves_real_arm=False).lease
    assert not control.take_for_queue("an experiment")
    control.give_back(lease)
    assert control.take_for_queue("an experiment")
    with pytest.raises(ProblemError, match="of the queue is running"):
        control.take("anna", moves_real_arm=False)
    control.give_back_for_queue()
    assert control.take("anna", moves_real_arm=False)


def test_silence_is_told_once(clock: HandClock, control: ControlService, lapsed: queue.Queue[str]) -> None:
    control.take("anna", moves_real_arm=False)
    clock.turn(LEASE_TIME)
    bert = control.take("bert", moves_real_arm=False)
    control.renew(bert.lease)
    assert control.status().name == "bert"
    control.close()
    assert lapsed.get_nowait() == "anna"
    assert lapsed.empty()


def test_a_listener_that_fails_ends_neither_the_watch_nor_the_next_lease(clock: HandClock) -> None:
    heard: queue.Queue[str] = queue.Queue()

    def fails(holder: str) -> None:
        heard.put(holder)
        raise OSError("database or disk is full")

    with closing(ControlService(clock, fails)) as control:
        for name in ("anna", "bert"):
            control.take(name, moves_real_arm=False)
            clock.turn(LEASE_TIME)
            if control.take_for_queue("an experiment"):  # the watch looks at the clock, where it has not done so before
                control.give_back_for_queue()
            assert heard.get(timeout=WITHIN) == name
        control.take("carl", moves_real_arm=False)
        clock.turn(LEASE_TIME)
        assert control.take("dora", moves_real_arm=False).lease
        assert heard.get(timeout=WITHIN) == "carl"


def test_the_queue_has_the_control_only_after_it_was_told_that_a_client_went_silent(
    control: ControlService, clock: HandClock, lapsed: queue.Queue[str]
) -> None:
    control.take("anna", moves_real_arm=False)
    clock.turn(LEASE_TIME)
    while not control.take_for_queue("an experiment"):
        assert lapsed.get(timeout=WITHIN) == "anna"
    assert control.status().holder == "queue"
    assert lapsed.empty()
