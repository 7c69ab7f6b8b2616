"""A taught program, shown and checked on the command line."""

import json
import math
from pathlib import Path

import pytest

from daq.teaching.program import Program, load_program
from tests.daq_cli.invoke import CommandLine

FILE = Path("pick.json")


@pytest.fixture(autouse=True)
def taught(empty_folder: Path) -> Path:
    """Step, wait, step, gripper."""
    del empty_folder
    program = {
        "name": "pick",
        "instructions": [
            {"kind": "absolute", "angles": {"1": math.pi, "2": math.radians(60)}, "speed": 0.2},
            {"kind": "wait", "duration": 1.5},
            {"kind": "relative", "angles": {"2": math.radians(-5)}},
            {"kind": "gripper", "closed": True},
        ],
    }
    FILE.write_text(json.dumps(program))
    return FILE


def test_a_program_is_shown_by_number_and_in_words(daq: CommandLine) -> None:
    lines = daq("teach", "show", FILE).out.splitlines()
    assert lines == [
        "pick, for ma2000: 4 instructions",
        "   1  to 1=180.00°, 2=60.00° at 11.5 °/s",
        "   2  wait 1.5 s",
        "   3  by 2=-5.00° at 14.3 °/s",
        "   4  gripper close",
    ]
    assert Program.model_validate(
        {name: value for name, value in json.loads(daq("teach", "show", FILE, "--json").out).items() if name != "file"}
    ) == load_program(FILE)


@pytest.mark.parametrize(
    ("before", "after", "code", "expected"),
    [
        ('"speed": 0.2', '"speed": 2.1', 4, ("instruction 1: joint 2", "°/s")),
        ('"2": 1.04', '"2": -1.4', 2, ("instruction 1: joint 2", "outside its range")),
        ('"speed": 0.2', '"speed": 1e9', 2, ("speed", "less than or equal to 3")),
    ],
)
def test_a_program_that_could_not_be_carried_out_is_told(
    daq: CommandLine, before: str, after: str, code: int, expected: tuple[str, ...]
) -> None:
    FILE.write_text(FILE.read_text().replace(before, after, 1))
    said = daq("teach", "show", FILE)
    assert said.code == code
    assert all(part in said.err for part in expected)
