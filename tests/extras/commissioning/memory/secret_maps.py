"""Memory maps that a seed hides in the mock, found by what `daq memory find` uses, in the board's own time."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, radians
from random import Random

from daq.contracts.machine import load_machine
from extras.commissioning.memory.commands import CommandProof, prove_by_command
from extras.commissioning.memory.findings import Findings
from extras.commissioning.memory.procedure import Finder, errors_now, may_have_power
from extras.commissioning.memory.recording import PageReading
from extras.commissioning.person.mock_hand import End, MockOperator
from firmware_protocol.memory_map import JOINTS, MemoryMap
from mock_controller.board.board import Board
from mock_controller.device import build_device
from mock_controller.hidden.memory import Documented, draw_memory
from mock_controller.options import Options

TARGET = ("position", "error", "power")
"""Registers of which nearly all must be found."""
LEAST_FOUND = 0.99
BLOCK = 48
"""Bytes of one request."""
BLOCK_US = 6_200
"""Time (µs) of a request for 48 bytes and its reply at 115200 baud."""


@dataclass
class BoardPage:
    """`Page` of a board in this process: every second reading begins at the other end."""

    board: Board
    _forward: bool = True

    @property
    def base(self) -> int:
        return self.board.memory.map.base

    @property
    def size(self) -> int:
        return self.board.memory.map.size

    @property
    def period_s(self) -> float:
        return self.board.parameters.timing.period * 1e-6

    def read(self) -> PageReading:
        board, begin_us = self.board, self.board.time_us
        starts = list(range(0, self.size, BLOCK))
        data = bytearray(self.size)
        for start in starts if self._forward else reversed(starts):
            count = min(BLOCK, self.size - start)
            board.run_until(board.time_us + BLOCK_US * count // BLOCK)
            data[start : start + count] = board.read(self.base + start, count)
        self._forward = not self._forward
        return PageReading((begin_us + board.time_us) * 0.5e-6, bytes(data))

    def read_byte(self, address: int) -> int:
        return self.board.read(address, 1)[0]

    def write_byte(self, address: int, value: int) -> None:
        self.board.write(address, bytes((value,)))

    def reconnect(self) -> bool:
        """Nothing to do without a line; the readings show an interruption."""
        return False

    def wait(self, seconds: float) -> None:
        self.board.run_until(self.board.time_us + round(seconds * 1e6))


@dataclass
class BoardArm:
    """`MockArm` of a board in this process."""

    board: Board

    def now(self) -> float:
        return self.board.time_us * 1e-6

    def emergency_stop(self, *, pressed: bool) -> Mapping[int, float]:
        self.board.press_emergency_stop(pressed)
        return {joint: degrees(angle) for joint, angle in enumerate(self.board.plant.joint_angles, start=1)}

    def lead(self, to: Mapping[int, float | End], seconds: float) -> Mapping[int, float]:
        angles = {
            joint: self.board.end_stop(joint, high=place == "high") if isinstance(place, str) else radians(place)
            for joint, place in to.items()
        }
        self.board.lead(angles, seconds)
        return {joint: degrees(angle) for joint, angle in angles.items()}

    def switch_off_and_on(self) -> None:
        self.board.brown_out()

    def inputs(self, bits: int) -> None:
        self.board.set_process_inputs(bits)


@dataclass(frozen=True)
class Score:
    """What was found of one map. Counters are by register."""

    found: Counter[str]
    wrong: tuple[str, ...]
    unproved_writes: int
    proofs: int
    contradiction_told: bool


def search(seed: int, documented: Documented) -> Score:
    """Finds one secret map, and compares."""
    random = Random(f"postures {seed}")
    start = tuple(random.randrange(200, 800) for _ in range(JOINTS))
    options = Options(tcp="nowhere:0", secret_map=seed, documented=documented, seed=seed, start=start, lock_step=True)
    board = build_device(options, lambda _: None).board
    page, arm = BoardPage(board), BoardArm(board)
    operator = MockOperator(arm, load_machine("ma2000"))
    findings = Finder(page, operator, inputs=5).find()
    proofs: list[CommandProof] = []
    if not may_have_power(errors_now(page, findings.joints)):
        arm.emergency_stop(pressed=False)
        page.wait(0.5)
        proofs = [prove_by_command(page, findings.joints, joint) for joint in range(1, JOINTS + 1)]
    return _score(documented, findings, draw_memory(seed, documented).map, page, proofs)


def _score(
    documented: Documented, findings: Findings, truth: MemoryMap, page: BoardPage, proofs: list[CommandProof]
) -> Score:
    found: Counter[str] = Counter()
    wrong = []
    for one in findings.all:
        if one.is_found:
            register, index = truth[one.register], (one.joint or 1) - 1
            right = one.low == register.low[index] and one.high == (register.high[index] if register.high else None)
            found[one.register] += right
            wrong += [f"{one.register} {one.joint}"] * (not right)
    allowed = set(truth["set_point"].low)
    told = [findings.of("position", joint).verdict == "contradicts" for joint in (1, 2, 3)]
    return Score(
        found,
        tuple(wrong),
        sum(address not in allowed for address in page.board.written.elements()),
        sum(proof.proved and proof.sign >= 0 for proof in proofs),
        all(told) if documented == "moved" else not any(told),
    )
