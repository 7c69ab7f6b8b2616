"""A map that was found is proved by smallest steps of a set point; a person completes it where a part is missing."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from extras.commissioning.memory.commands import prove_by_command
from extras.commissioning.memory.findings import Finding, Findings, begun_map_text
from extras.commissioning.memory.joint import JointEvidence, SetPointBytes
from extras.commissioning.memory.procedure import may_have_power
from extras.commissioning.memory.recording import PageReading
from extras.commissioning.memory.relations import Pair, Place
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import SINGLE_REGISTERS, default_memory_map, parse_memory_map
from firmware_protocol.units import posture_to_counts

# ---- what is written, in what order, and when the proof ends


BASE = 0xFC00


@dataclass
class Arm:
    """A page with one joint: position at 0 and 1, error at 2 and 3, set point at 4 and 5 (low byte first)."""

    posture: int
    sign: int = 1
    kept: bool = True
    base: int = BASE
    size: int = 8
    period_s: float = 0.02
    writes: list[tuple[int, int]] = field(default_factory=list)
    time: float = 0.0

    def __post_init__(self) -> None:
        self.start = posture_to_counts(self.posture)

    def bytes(self) -> bytes:
        target = posture_to_counts(self.posture)
        position = self.start + self.sign * (target - self.start)
        error = (target - position) & 0xFFFF
        return bytes(byte for value in (position, error, self.posture) for byte in (value & 0xFF, value >> 8)) + bytes(
            2
        )

    def read(self) -> PageReading:
        self.time += 0.02
        return PageReading(self.time, self.bytes())

    def read_byte(self, address: int) -> int:
        return self.bytes()[address - BASE]

    def write_byte(self, address: int, value: int) -> None:
        self.writes.append((address, value))
        if self.kept:
            assert address == BASE + 4
            self.posture = self.posture & 0x300 | value

    def reconnect(self) -> bool:
        return False

    def wait(self, seconds: float) -> None:
        self.time += seconds


def evidence(*, proved: bool = True) -> JointEvidence:
    pair = Pair(Place(0, 1), Place(2, 3), 1.0, 0.0)
    place = SetPointBytes((4,), (5,) if proved else (5, 7), (100, 300, 500))
    return JointEvidence(1, pair, None, place)


def test_the_value_that_is_there_is_written_first_then_one_unit_more_and_at_last_the_old_value() -> None:
    arm = Arm(500)
    proof = prove_by_command(arm, [evidence()], 1)
    assert (proof.proved, proof.sign, proof.step) == (True, 1, 1)
    assert arm.writes == [(BASE + 4, 0xF4), (BASE + 4, 0xF5), (BASE + 4, 0xF4)]


def test_steps_go_down_where_the_high_byte_would_change() -> None:
    assert prove_by_command(Arm(510), [evidence()], 1).step == -1


WRONG_PLACE = JointEvidence(1, Pair(Place(0, 1), Place(4), 1.0, 0.0), None, evidence().set_point)


@pytest.mark.parametrize(
    ("changes", "given", "problem", "most_writes"),
    [
        ({"sign": -1}, evidence(), "moves away from its set point", 3),
        ({"kept": False}, evidence(), "was read back", 3),
        ({}, evidence(proved=False), "not proved", 0),
        ({}, WRONG_PLACE, "", 0),
    ],
    ids=["a drive of the wrong sign", "no set point", "a place that is not proved", "no error plus position"],
)
def test_a_proof_that_fails_says_why_and_leaves_the_old_value(
    changes: dict[str, Any], given: JointEvidence, problem: str, most_writes: int
) -> None:
    arm = Arm(500, **changes)
    proof = prove_by_command(arm, [given], 1)
    assert proof.problem
    assert problem in proof.problem
    assert not (proof.proved and proof.sign >= 0)
    assert len(arm.writes) <= most_writes
    assert arm.writes[-1:] == ([(BASE + 4, 0xF4)] if most_writes else [])


@pytest.mark.parametrize("changed", [0x2F4, 0x177])
def test_the_old_low_byte_is_not_written_under_another_high_byte_nor_over_a_byte_of_another(changed: int) -> None:
    @dataclass
    class Changing(Arm):
        def wait(self, seconds: float) -> None:
            super().wait(seconds)
            self.posture = changed

    arm = Changing(500)
    proof = prove_by_command(arm, [evidence()], 1)
    assert "press the emergency stop" in proof.problem
    assert not proof.proved
    assert arm.writes == [(BASE + 4, 0xF4)]


def test_a_large_error_after_a_write_ends_the_proof() -> None:
    @dataclass
    class Stuck(Arm):
        def bytes(self) -> bytes:
            self.sign = 0
            self.start = posture_to_counts(500) - 30
            return super().bytes()

    proof = prove_by_command(Stuck(500), [evidence()], 1)
    assert "the error of joint 1 is 30" in proof.problem


def test_the_drives_get_no_power_while_an_error_is_large_or_unknown() -> None:
    assert "known" in may_have_power({1: 0})
    assert "joint 4: 300" in may_have_power(dict.fromkeys(range(1, 7), 0) | {4: 300})
    assert may_have_power(dict.fromkeys(range(1, 7), 3)) == ""


# ---- a map of which a part was found


SHIPPED = default_memory_map()
UNKNOWN = ("gain_p", "gain_i", "gain_d", "gripper")


def findings() -> Findings:
    """Everything found where the shipped map has it, but for the gains and the gripper."""
    every = []
    for name, register in SHIPPED.registers.items():
        for index, low in enumerate(register.low):
            joint = None if name in SINGLE_REGISTERS else index + 1
            high = None if register.high is None else register.high[index]
            where = (None, None) if name in UNKNOWN else (low, high)
            every.append(Finding(name, joint, "unknown" if name in UNKNOWN else "found", *where))
    return Findings(SHIPPED.base, SHIPPED.size, tuple(every), (), (), ())


def test_once_its_question_marks_are_addresses_it_is_a_memory_map() -> None:
    text = begun_map_text(findings())
    wanted = [address for name in SHIPPED.registers if name in UNKNOWN for address in SHIPPED[name].low]
    with pytest.raises(MemoryMapError):
        parse_memory_map(text, "begun")
    for address in wanted:
        head, mark, rest = text.partition("?")
        assert mark
        text = f"{head}0x{address:04X}{rest}"
    completed = parse_memory_map(text, "completed")
    for name, register in SHIPPED.registers.items():
        assert (completed[name].low, completed[name].high) == (register.low, register.high)
        assert set(completed[name].provenance) == {"assumed" if name in UNKNOWN else "found"}
