"""Faults as they are asked for, and what those of the line, of parts and of the supply do."""

import inspect
import re
from pathlib import Path
from statistics import pstdev

import pytest

from firmware_protocol.commands import Advance, ReadStatus, Sample, Snapshot, Status
from firmware_protocol.commands import WriteSetPoints as Write
from firmware_protocol.joints import ALL_JOINTS, JointReading
from mock_controller.faults.fault import FaultError, fields_of
from mock_controller.faults.registry import FAULTS, describe, parse_fault, table
from tests.mock.host import LockStepHost, RealTimeHost, make_device

NAMES = (
    "flip",
    "drop",
    "duplicate",
    "delay",
    "split",
    "junk",
    "stall",
    "disconnect",
    "busy_memory",
    "stuck_potentiometer",
    "noisy_potentiometer",
    "stalled_joint",
    "brown_out",
)


def test_every_fault_has_a_name_a_line_and_its_place_in_the_guide() -> None:
    assert tuple(FAULTS) == NAMES
    text = table()
    for name, kind in FAULTS.items():
        assert f"{name}: {kind.summary()}" in text
        assert describe(parse_fault(name))["name"] == name
    assert parse_fault("disconnect").duration == 0.0, "its own seconds say when it ends"
    guide = (Path(__file__).parents[3] / "docs" / "mock.md").read_text("utf-8")
    listed = dict(re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|[^|]*\|$", guide, re.MULTILINE))
    assert tuple(listed) == NAMES
    for name, kind in FAULTS.items():
        own = set(inspect.get_annotations(kind)) - {"name"}
        named = set(re.findall(r"`(\w+)`", listed[name]))
        assert named <= set(fields_of(kind))
        assert own - named <= {"duration"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("flop", "fault 'flop': not known; available: flip, drop"),
        ("", "fault '': not known"),
        ("flip:rat=1", "fault flip: no parameter 'rat=1'; write parameter=value with start, duration"),
        ("flip:0.01", "fault flip: no parameter '0.01'"),
        ("flip:rate=lots", "fault flip: rate is 'lots', must be a number"),
        ("flip:rate=1.5", "fault flip: rate is 1.5, allowed are 0.0 to 1.0"),
        ("flip:rate=nan", "fault flip: rate is nan, allowed are 0.0 to 1.0"),
        ("flip:bits=0", "fault flip: bits is 0, allowed are 1 to 64"),
        ("flip:bits=1.5", "fault flip: bits is '1.5', must be a whole number"),
        ("drop:direction=up", "fault drop: direction is 'up', allowed are both, to_controller, to_host"),
        ("stalled_joint:joint=7", "fault stalled_joint: joint is 7, allowed are 1 to 6"),
        ("delay:ms=-1", "fault delay: ms is -1, allowed are 0.0 to 60000.0"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(text: str, words: str) -> None:
    with pytest.raises(FaultError) as caught:
        parse_fault(text)
    assert str(caught.value).startswith(words)
    assert "\n" not in str(caught.value)


# ---- Switching on and off, spans of time, labels, seeds


def answered(host: LockStepHost, number: int) -> bool:
    return bool(host.replies(ReadStatus(), number))


def test_a_fault_acts_for_its_duration_and_is_then_no_longer_listed() -> None:
    host = LockStepHost(fault=("drop:direction=to_host,start=0.1,duration=0.05",))
    lost = []
    for number in range(20):
        lost.append(not answered(host, number))
        host.board.run_until(host.board.time_us + 10_000)
    assert lost == [False] * 10 + [True] * 5 + [False] * 5
    host = LockStepHost(fault=("drop:rate=0,duration=0.1", "flip:rate=0"))
    assert [entry["label"] for entry in host.device.faults.listing()] == ["drop", "flip"]
    host.ask(Advance(200_000))
    assert [entry["label"] for entry in host.device.faults.listing()] == ["flip"]


def test_faults_of_one_name_have_labels_and_numbers_of_their_own() -> None:
    faults = make_device().faults
    labels = [faults.switch_on(f"stuck_potentiometer:joint={joint}").label for joint in (1, 2, 3)]
    assert labels == ["stuck_potentiometer", "stuck_potentiometer#2", "stuck_potentiometer#3"]
    assert faults.switch_off("stuck_potentiometer#2") == ["stuck_potentiometer#2"]
    assert faults.switch_off("stuck_potentiometer") == ["stuck_potentiometer", "stuck_potentiometer#3"]
    with pytest.raises(FaultError, match="is not switched on; switched on are: none"):
        faults.switch_off("stuck_potentiometer")

    def losses(*faults: str, seed: int = 0) -> list[bool]:
        host = LockStepHost(fault=faults, seed=seed)
        return [not answered(host, number) for number in range(60)]

    alone = losses("drop:rate=0.3,direction=to_host")
    assert losses("drop:rate=0.3,direction=to_host", "busy_memory:rate=0.5") == alone
    assert losses("drop:rate=0.3,direction=to_host", seed=1) != alone
    own = losses("drop:rate=0.3,direction=to_host,seed=5")
    assert losses("drop:rate=0.3,direction=to_host,seed=5", seed=1) == own


# ---- Faults of the line: what each does to a frame, and that each one injected is counted


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


def test_damage_is_noticed_and_junk_damages_nothing_but_itself() -> None:
    host, answers = exchange("flip:rate=0.1,seed=1")
    struck = counted(host, "flip")
    assert len(answers) == 300 - struck["to_controller"] - struck["to_host"]
    assert 10 < struck["to_controller"] < 60
    assert 10 < struck["to_host"] < 60
    # A bit that makes a delimiter damages two pieces; a last delimiter that is lost, none until the next frame.
    assert host.device.link.counts.damaged >= struck["to_controller"] - 1
    assert host.dialect.damaged >= struck["to_host"] - 1
    host, answers = exchange("junk:rate=0.2")
    struck = counted(host, "junk")
    assert [number for number, _ in answers] == list(range(300))
    assert host.device.link.counts.damaged == struck["to_controller"]
    assert host.dialect.damaged == struck["to_host"]
    host, answers = exchange("duplicate:rate=0.1,direction=to_controller,ms=12")
    struck = counted(host, "duplicate")["to_controller"]
    assert len(answers) == 300 + struck
    assert sum(delay == 12_000 for _, delay in answers) == struck


def test_late_and_split_frames_arrive_in_the_end() -> None:
    host, answers = exchange("delay:rate=0.1,direction=to_host,ms=12")
    struck = counted(host, "delay")["to_host"]
    late = [delay for _, delay in answers if delay == 12_000]
    numbers = [number for number, _ in answers]
    assert len(late) == struck
    assert sorted(numbers) == list(range(300))
    assert numbers != sorted(numbers)
    host, answers = exchange("split:rate=0.2,direction=to_controller,ms=3")
    struck = counted(host, "split")["to_controller"]
    assert [number for number, _ in answers] == list(range(300))
    # Where only the first or the last delimiter was cut off, the frame was whole before or after the pause.
    assert struck * 0.7 <= sum(delay == 3_000 for _, delay in answers) <= struck
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


# ---- Faults of memory, sensors, arm and supply


def sampled(host: LockStepHost, periods: int, after: int | None = None) -> list[Snapshot]:
    """The next periods, one after the other."""
    found: list[Snapshot] = []
    tick = host.board.tick if after is None else after
    for _ in range(periods):
        reply = host.ask(Sample(tick, ALL_JOINTS))
        assert isinstance(reply, Snapshot)
        found.append(reply)
        tick = reply.tick
    return found


def readings(snapshots: list[Snapshot], joint: int) -> list[JointReading]:
    return [dict(snapshot.joints)[joint] for snapshot in snapshots]


def test_a_stuck_potentiometer_recovers_and_a_noisy_one_scatters() -> None:
    host = LockStepHost()
    host.ask(Advance(100_000))
    host.device.faults.switch_on("stuck_potentiometer:joint=1,duration=0.4")
    host.ask(Write(((1, 510),)))
    before = readings(sampled(host, 18), 1)
    assert len({r.position for r in before}) == 1
    assert len({r.position for r in readings(sampled(host, 18), 1)}) > 1
    host = LockStepHost(fault=("noisy_potentiometer:joint=5,counts=30,start=1,duration=2",))
    quiet = [r.position for r in readings(sampled(host, 49), 5)][30:]
    loud = [r.position for r in readings(sampled(host, 95), 5)]
    assert pstdev(quiet) < 3
    assert pstdev(loud) > 15
    assert host.device.faults.counts()["noisy_potentiometer"]["board"] > 90
