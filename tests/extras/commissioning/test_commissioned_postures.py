"""Postures of a protractor that say nothing are asked for again; what was measured before stays until all is done."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from daq.contracts.machine import load_machine
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.bench import Bench
from extras.commissioning.command.by_hand import potentiometers
from extras.commissioning.command.record import Record
from extras.commissioning.memory.procedure import Task
from extras.commissioning.person.mock_hand import MockOperator, mock_operator
from tests.extras.commissioning.test_whole_commissioning import mock


@dataclass
class Clumsy:
    """Presses Enter too early, forgets to move the joint, and takes one posture back."""

    hand: MockOperator
    folder: Path
    told: list[str] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)
    slips: list[Literal["enter", "still", "back"]] = field(default_factory=lambda: ["enter", "still", "back"])

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        return self.hand.may_begin(at_the_arm=at_the_arm, yes=yes)

    def begin(self, task: Task) -> bool:
        return self.hand.begin(task)

    def finished(self) -> bool:
        return self.hand.finished()

    def watch(self, postures: Mapping[int, int]) -> None:
        self.hand.watch(postures)

    def show(self, text: str) -> None:
        self.told.append(text)

    def read_angle(
        self, joint: int, number: int, wait: Callable[[float], None]
    ) -> float | Literal["taken back"] | None:
        assert not (self.folder / "machine.toml").exists(), "written only when all is measured"
        self.asked.append(number)
        if number > 1 and self.slips:
            match self.slips.pop(0):
                case "enter":
                    return None
                case "still":
                    return 12.0
                case "back":
                    return "taken back"
        return self.hand.read_angle(joint, number, wait)


def test_an_early_enter_and_a_joint_that_was_not_moved_do_not_end_the_step(tmp_path: Path) -> None:
    with mock("") as arm:
        assert arm.control is not None
        with mock_operator(arm.control, load_machine("ma2000"), lambda _text: None, lock_step=True) as hand:
            person = Clumsy(hand, tmp_path)
            call = Invocation(port_option=f"{arm.url}?lock_step=1")
            bench = Bench(call, tmp_path, person, ConsentPrompt(True), Record.of(tmp_path), (1,), 5)
            found = potentiometers(bench)
    assert person.asked == [1, 2, 2, 2, 1, 2, 3, 4, 5]
    assert len(found["joint_1"]["counts"]) == 5
    assert any("1 postures, at least 5 are needed" in line for line in person.told)
    assert any("not counted; move it further" in line for line in person.told)
    assert (tmp_path / "machine.toml").exists()
