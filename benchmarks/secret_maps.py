"""Memory maps that a seed hides, found again: how many registers, how many wrongly, and writes where nothing is proved.

python -m benchmarks secret_maps                      the registered seeds for the report
python -m benchmarks secret_maps --set tuning         those that thresholds were chosen by
python -m benchmarks secret_maps --seeds 0-9          others

Exit code 1 when a target is missed. Each map is drawn by the mock and found by what `daq memory find` uses, in the
board's own time; blocks of the memory are read as far apart as on a line of 115200 baud.
"""

from __future__ import annotations

import argparse
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import degrees, radians
from pathlib import Path
from random import Random

from benchmarks.figures import Figure, at_least, at_most, show
from daq.commissioning.memory.commands import CommandProof, prove_by_command
from daq.commissioning.memory.findings import Findings
from daq.commissioning.memory.procedure import Finder, errors_now, may_have_power
from daq.commissioning.memory.recording import PageReading
from daq.contracts.machine import load_machine
from daq_cli.robot.mock_hand import End, MockOperator
from firmware_protocol.memory_map import JOINTS, MemoryMap
from mock_controller.board.board import Board
from mock_controller.device import build_device
from mock_controller.hidden.memory import Documented, draw_memory
from mock_controller.options import Options

REGISTRATION = Path(__file__).parent.parent / "docs" / "secret-maps.toml"
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
    writes: list[int] = field(default_factory=list)
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
        self.writes.append(address)
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

    seed: int
    documented: Documented
    found: Counter[str]
    wrong: tuple[str, ...]
    writes: int
    unproved_writes: int
    proofs: int
    contradiction_told: bool
    seconds: float
    open: tuple[str, ...]
    complete: bool
    """Whether every register has a place, be it found or assumed."""
    right: bool
    """Whether every place of the memory map, those that are assumed too, is the true one."""
    usable: bool
    """Whether a memory map could be written, perhaps without gains, process signals or gripper."""


def search(seed: int, documented: Documented, *, commands: bool = True) -> Score:
    """Finds one secret map, and compares."""
    begun = time.process_time()
    random = Random(f"postures {seed}")
    start = tuple(random.randrange(200, 800) for _ in range(JOINTS))
    options = Options(tcp="nowhere:0", secret_map=seed, documented=documented, seed=seed, start=start, lock_step=True)
    board = build_device(options, lambda _: None).board
    page, arm = BoardPage(board), BoardArm(board)
    operator = MockOperator(arm, load_machine("ma2000"))
    findings = Finder(page, operator, inputs=5).find()
    proofs: list[CommandProof] = []
    if commands and not may_have_power(errors_now(page, findings.joints)):
        arm.emergency_stop(pressed=False)
        page.wait(0.5)
        proofs = [prove_by_command(page, findings.joints, joint) for joint in range(1, JOINTS + 1)]
    return _score(seed, documented, findings, draw_memory(seed, documented).map, page, proofs, begun)


def _score(
    seed: int,
    documented: Documented,
    findings: Findings,
    truth: MemoryMap,
    page: BoardPage,
    proofs: list[CommandProof],
    begun: float,
) -> Score:
    found: Counter[str] = Counter()
    wrong, still_open = [], []
    for one in findings.all:
        if not one.is_found:
            still_open.append(f"{one.register} {one.joint}: {one.evidence}")
            continue
        register, index = truth[one.register], (one.joint or 1) - 1
        right = one.low == register.low[index] and one.high == (register.high[index] if register.high else None)
        found[one.register] += right
        if not right:
            wrong.append(f"{one.register} {one.joint}")
    allowed = set(truth["set_point"].low)
    told = [findings.of("position", joint).verdict == "contradicts" for joint in (1, 2, 3)]
    return Score(
        seed,
        documented,
        found,
        tuple(wrong),
        len(page.writes),
        sum(address not in allowed for address in page.board.written.elements()),
        sum(proof.proved and proof.sign >= 0 for proof in proofs),
        all(told) if documented == "moved" else not any(told),
        time.process_time() - begun,
        tuple(still_open),
        not findings.missing(),
        _is_right(findings, truth),
        findings.memory_map("") is not None,
    )


def _is_right(findings: Findings, truth: MemoryMap) -> bool:
    """Whether a memory map was found, and has each of its registers where it is."""
    found = findings.memory_map("")
    return found is not None and all(
        (one.low, one.high) == (truth[name].low, truth[name].high) for name, one in found.registers.items()
    )


def registered(name: str) -> list[int]:
    """The seeds of a set of the registration."""
    first, last = tomllib.loads(REGISTRATION.read_text("utf-8"))["seeds"][name]
    return list(range(first, last + 1))


def figures(scores: list[Score]) -> list[Figure]:
    """The figures of a campaign."""
    total = JOINTS * len(scores)
    found: Counter[str] = sum((score.found for score in scores), Counter())
    result = [at_least(f"{name} found", found[name] / total, LEAST_FOUND, "of all") for name in TARGET]
    result += [
        at_most("found where something else lies", sum(len(score.wrong) for score in scores), 0, "registers"),
        at_most("writes to an unproved address", sum(score.unproved_writes for score in scores), 0, "writes"),
        at_least(
            "documented addresses told rightly", sum(s.contradiction_told for s in scores) / len(scores), 1, "of maps"
        ),
        Figure("set points found", f"{found['set_point'] / total:.3f} of all"),
        Figure("set points proved by command", f"{sum(score.proofs for score in scores) / total:.3f} of all"),
        Figure("complete: every register has a place", f"{sum(score.complete for score in scores)} maps"),
        Figure(
            "complete, and everything assumed is right",
            f"{sum(score.complete and score.right for score in scores)} maps",
        ),
        Figure("a register assumed where something else lies", f"{sum(not score.right for score in scores)} maps"),
        Figure(
            "usable: complete, or without gains, process signals or gripper",
            f"{sum(score.usable for score in scores)} maps",
        ),
        Figure("process inputs found", f"{found['process_inputs'] / len(scores):.3f} of maps"),
        Figure("writes", f"{sum(score.writes for score in scores)}"),
        Figure("processor time a map", f"{sum(score.seconds for score in scores) / len(scores):.2f} s"),
    ]
    return result


def _range(text: str) -> list[int]:
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


def main(arguments: list[str]) -> int:
    """Prints the figures; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks secret_maps", description=__doc__)
    parser.add_argument("--set", choices=("tuning", "reporting"), default="reporting")
    parser.add_argument("--seeds", type=_range, metavar="FIRST-LAST")
    parser.add_argument("--verbose", action="store_true", help="print what stays open on each map")
    given = parser.parse_args(arguments)
    scores = []
    for seed in given.seeds or registered(given.set):
        score = search(seed, "kept" if seed % 2 else "moved")
        scores.append(score)
        if given.verbose or score.wrong or score.unproved_writes:
            print(f"{seed} {score.documented}: {dict(score.found)} wrong {score.wrong} {score.seconds:.2f} s")
            for line in score.open if given.verbose else ():
                print("   ", line)
    return show(f"{len(scores)} secret memory maps", "python -m benchmarks secret_maps", figures(scores))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
