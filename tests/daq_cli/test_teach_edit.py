"""A taught program edited on the command line: what is possible gives a program, the rest leaves the file as it was."""

import json
import math
from pathlib import Path

import pytest

from daq.teaching.program import Absolute, AwaitInput, Gripper, Program, Relative, SetOutput, Wait, load_program
from tests.daq_cli.invoke import CommandLine

FILE = Path("pick.json")
EDIT = ("teach", "edit")


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


def kinds() -> list[str]:
    return [one.kind for one in load_program(FILE).instructions]


def test_the_list_shows_the_numbers_that_other_commands_take(daq: CommandLine) -> None:
    lines = daq(*EDIT, "list", FILE).out.splitlines()
    assert lines == [
        "pick, for ma2000: 4 instructions",
        "   1  to 1=180.00°, 2=60.00° at 11.5 °/s",
        "   2  wait 1.5 s",
        "   3  by 2=-5.00° at 14.3 °/s",
        "   4  gripper close",
    ]
    assert Program.model_validate(
        {name: value for name, value in json.loads(daq(*EDIT, "list", FILE, "--json").out).items() if name != "file"}
    ) == load_program(FILE)


def test_control_characters_in_a_program_are_not_printed(daq: CommandLine) -> None:
    FILE.write_text(FILE.read_text().replace('"name"', '"machine": "a\\u001b[2J", "name"', 1))
    said = daq(*EDIT, "list", FILE)
    assert "\x1b" not in said.out + said.err


def test_instructions_are_deleted_and_moved_and_programs_renamed(daq: CommandLine) -> None:
    assert daq(*EDIT, "delete", FILE, 2).out == "pick.json: 3 instructions\n"
    assert kinds() == ["absolute", "relative", "gripper"]
    assert daq(*EDIT, "move", FILE, 3, 1).code == 0
    assert kinds() == ["gripper", "absolute", "relative"]
    assert daq(*EDIT, "rename", FILE, "place-2").code == 0
    assert load_program(FILE).name == "place-2"


@pytest.mark.parametrize(
    ("options", "made"),
    [
        ("--wait 2", Wait(duration=2)),
        (
            "--to 1=170,3=-20 --speed 5",
            Absolute(angles={1: math.radians(170), 3: math.radians(-20)}, speed=math.radians(5)),
        ),
        ("--by 2=3", Relative(angles={2: math.radians(3)})),
        ("--output 3=on", SetOutput(line=3, on=True)),
        ("--input 0=off", AwaitInput(line=0, on=False)),
        ("--gripper open", Gripper(closed=False)),
    ],
)
@pytest.mark.parametrize("place", [1, 5])
def test_an_instruction_is_inserted_at_its_number(daq: CommandLine, options: str, made: object, place: int) -> None:
    said = daq(*EDIT, "insert", FILE, place, *options.split())
    assert said.code == 0, said.err
    assert load_program(FILE).instructions[place - 1] == made
    assert len(kinds()) == 5


def test_speed_pause_and_posture_of_an_instruction_are_changed(daq: CommandLine) -> None:
    assert daq(*EDIT, "change", FILE, 1, "--speed", "20", "--angles", "2=50").code == 0
    assert daq(*EDIT, "change", FILE, 2, "--wait", "0.5").code == 0
    first, second, *_ = load_program(FILE).instructions
    assert first == Absolute(angles={1: math.pi, 2: math.radians(50)}, speed=math.radians(20))
    assert second == Wait(duration=0.5)


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        ("delete pick.json 5", 2, ("instruction 5", "takes 1 to 4 here")),
        ("delete pick.json 0", 2, ("instruction 0", "takes 1 to 4 here")),
        ("move pick.json 1 9", 2, ("instruction 9", "takes 1 to 4 here")),
        ("insert pick.json 6 --wait 1", 2, ("instruction 6", "takes 1 to 5 here")),
        ("insert pick.json 1", 2, ("give one of --to, --by", "0 are given")),
        ("insert pick.json 1 --wait 1 --by 1=2", 2, ("give one of", "2 are given")),
        ("insert pick.json 1 --wait 1 --speed 3", 2, ("--speed goes with --to and --by",)),
        ("insert pick.json 1 --wait nan", 2, ("duration", "finite")),
        ("insert pick.json 1 --to 9=1", 2, ("angles", "less than or equal to 6")),
        ("insert pick.json 1 --output 8=on", 2, ("line", "less than or equal to 7")),
        ("insert pick.json 1 --gripper shut", 2, ("allowed are open and close",)),
        ("change pick.json 2 --speed 5", 2, ("'wait' and has no speed", "it has duration")),
        ("change pick.json 1 --wait 5", 2, ("'absolute' and has no duration",)),
        ("change pick.json 1 --speed 1e9", 2, ("speed", "less than or equal to 3")),
        ("change pick.json 1", 2, ("nothing to change",)),
        ("change pick.json 1 --speed 120", 4, ("refused: instruction 1: joint 2", "°/s", "the file is as it was")),
        ("insert pick.json 1 --to 2=100 --speed 120", 4, ("refused: instruction 1: joint 2", "°/s")),
        ("change pick.json 1 --angles 2=-80", 2, ("instruction 1: joint 2", "outside its range")),
        ("rename pick.json a/b", 2, ("name = 'a/b'", "pattern")),
        ("delete missing.json 1", 2, ("missing.json", "cannot be read")),
    ],
)
def test_a_refused_change_leaves_the_file_as_it_was(
    daq: CommandLine, words: str, code: int, expected: tuple[str, ...]
) -> None:
    before = FILE.read_bytes()
    daq(*EDIT, *words.split()).complains(code, *expected)
    assert FILE.read_bytes() == before
    assert list(Path().glob("*.part")) == []


def test_the_only_instruction_stays(daq: CommandLine) -> None:
    for _ in range(3):
        assert daq(*EDIT, "delete", FILE, 1).code == 0
    daq(*EDIT, "delete", FILE, 1).complains(2, "its only instruction cannot be deleted")
    assert kinds() == ["gripper"]


def test_a_program_outside_the_limits_can_be_corrected_step_by_step(daq: CommandLine) -> None:
    FILE.write_text(
        '{"name": "low", "instructions": [{"kind": "absolute", "angles": {"2": -1.5}}, '
        '{"kind": "absolute", "angles": {"2": -1.4}}]}'
    )
    assert daq(*EDIT, "change", FILE, 1, "--angles", "2=45").code == 0
    assert daq(*EDIT, "change", FILE, 2, "--angles", "2=50").code == 0


def test_a_toml_program_keeps_its_comments(daq: CommandLine) -> None:
    Path("pick.toml").write_text('name = "x"  # mine\n[[instructions]]\nkind = "wait"\nduration = 1\n')
    daq(*EDIT, "rename", "pick.toml", "y").complains(2, "is TOML", "edit it as text")
    assert daq(*EDIT, "list", "pick.toml").code == 0
