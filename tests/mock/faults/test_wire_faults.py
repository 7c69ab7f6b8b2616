"""Faults of the line: what each does to a frame, and that each one injected is counted."""

import pytest

from firmware_protocol.commands import ReadStatus, Status
from tests.mock.host import RealTimeHost


def exchange(fault: str, requests: int = 300, apart_us: int = 5_000) -> tuple[RealTimeHost, list[tuple[int, int]]]:
    """Status requests under a fault; (number, µs from its request to its reply) of every reply."""
    host = RealTimeHost(fault=(fault,))
    answers = []
    for number in range(requests):
        host.send(number, ReadStatus())
        for moment, answered, reply in host.wait(apart_us):
            assert isinstance(reply, Status)
            answers.append((answered, (number - answered) * apart_us + moment))
    return host, answers


def counted(host: RealTimeHost, name: str) -> dict[str, int]:
    counts = host.device.faults.counts()
    assert set(counts) <= {name}
    return counts.get(name, {})


def test_flipped_bits_are_noticed_by_the_receiver() -> None:
    host, answers = exchange("flip:rate=0.1,seed=1")
    struck = counted(host, "flip")
    assert len(answers) == 300 - struck["to_controller"] - struck["to_host"]
    assert 10 < struck["to_controller"] < 60
    assert 10 < struck["to_host"] < 60
    # A bit that makes a delimiter damages two pieces; a last delimiter that is lost, none until the next frame.
    assert host.device.link.counts.damaged >= struck["to_controller"] - 1
    assert host.dialect.damaged >= struck["to_host"] - 1


@pytest.mark.parametrize("direction", ["to_controller", "to_host"])
def test_dropped_frames_are_gone(direction: str) -> None:
    host, answers = exchange(f"drop:rate=0.1,direction={direction}")
    struck = counted(host, "drop")
    assert set(struck) == {direction}
    assert len(answers) == 300 - struck[direction]
    assert host.device.link.counts.damaged == host.dialect.damaged == 0


def test_duplicated_requests_are_answered_twice() -> None:
    host, answers = exchange("duplicate:rate=0.1,direction=to_controller,ms=12")
    struck = counted(host, "duplicate")["to_controller"]
    assert len(answers) == 300 + struck
    assert sum(delay == 12_000 for _, delay in answers) == struck


def test_delayed_replies_are_overtaken() -> None:
    host, answers = exchange("delay:rate=0.1,direction=to_host,ms=12")
    struck = counted(host, "delay")["to_host"]
    late = [delay for _, delay in answers if delay == 12_000]
    numbers = [number for number, _ in answers]
    assert len(late) == struck
    assert sorted(numbers) == list(range(300))
    assert numbers != sorted(numbers)


def test_a_split_frame_arrives_whole_in_the_end() -> None:
    host, answers = exchange("split:rate=0.2,direction=to_controller,ms=3")
    struck = counted(host, "split")["to_controller"]
    assert [number for number, _ in answers] == list(range(300))
    # Where only the first or the last delimiter was cut off, the frame was whole before or after the pause.
    assert struck * 0.7 <= sum(delay == 3_000 for _, delay in answers) <= struck


def test_junk_damages_nothing_but_itself() -> None:
    host, answers = exchange("junk:rate=0.2")
    struck = counted(host, "junk")
    assert [number for number, _ in answers] == list(range(300))
    assert host.device.link.counts.damaged == struck["to_controller"]
    assert host.dialect.damaged == struck["to_host"]


def test_a_stalled_bridge_answers_everything_at_the_end_of_it() -> None:
    host, answers = exchange("stall:start=0.0501,duration=0.1")
    held = [(number, delay) for number, delay in answers if delay]
    assert [number for number, _ in answers] == list(range(300))
    assert [number * 5_000 + delay for number, delay in held] == [150_100] * 20
    assert counted(host, "stall") == {"to_controller": 20}


def test_faults_of_the_line_come_in_the_order_they_were_switched_on() -> None:
    host = RealTimeHost(fault=("duplicate", "drop:rate=0.5,seed=1"))
    for number in range(50):
        host.send(number, ReadStatus())
    host.wait(1_000)
    counts = host.device.faults.counts()
    assert counts["duplicate"]["to_controller"] == 50
    assert 25 < counts["drop"]["to_controller"] < 75
