"""Taught programs: plain files, planned and checked from end to end before they move anything."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.teaching.arm import TeachingError
from daq.teaching.program import Program, load_program, parse_program, program_text, require_program_file, save_program
from daq.teaching.program_plan import PlannedInstruction, check_program, plan_program, run_program
from daq.trajectories.set_points import Plan
from tests.daq.teaching.stand_in import MA2000, REST

PATH = {"joints": [1], "times": [0, 0.5, 1.0], "positions": [[3.0], [3.1], [3.0]]}
EVERYTHING = {
    "name": "pick",
    "instructions": [
        {"kind": "absolute", "angles": {"1": 3.0, "2": 1.0}, "speed": 0.3},
        {"kind": "gripper", "closed": True},
        {"kind": "relative", "angles": {"2": 0.2}},
        {"kind": "path", "path": PATH, "rate": 0.5},
        {"kind": "output", "line": 3, "on": True},
        {"kind": "wait", "duration": 0.5},
        {"kind": "input", "line": 2, "on": True, "longest": 1.0},
    ],
}


def program(*instructions: dict[str, object]) -> Program:
    return Program.model_validate({"name": "p", "instructions": instructions})


def planned(*instructions: dict[str, object]) -> list[PlannedInstruction]:
    return plan_program(program(*instructions), MA2000, REST.tolist())


class Diary:
    """A performer that writes down what it is asked to do."""

    def __init__(self, input_on_after: int = 3) -> None:
        self.entries: list[str] = []
        self.periods = 0
        self.input_on_after = input_on_after

    def follow(self, plan: Plan) -> None:
        self.entries.append(f"follow {plan.moving}")

    def observe(self, periods: int) -> None:
        self.periods += periods
        self.entries.append(f"observe {periods}")

    def input_is_on(self, line: int) -> bool:
        return self.periods >= self.input_on_after

    def set_output(self, line: int, *, on: bool) -> None:
        self.entries.append(f"output {line} {on}")

    def set_gripper(self, *, closed: bool) -> None:
        self.entries.append(f"gripper {closed}")


def test_steps_arrive_together_and_go_on_from_where_the_one_before_ended() -> None:
    (item,) = planned({"kind": "absolute", "angles": {1: 3.4, 3: -0.2}, "speed": 0.2})
    (made,) = item.plans
    assert made.moving == (1, 3)
    assert made.angles[-1, [0, 2]] == pytest.approx([3.4, -0.2], abs=0.0024)
    assert np.abs(np.diff(made.angles, axis=0)).max() <= 0.2 * 0.02 + 1e-12
    way = made.angles[-1] - made.angles[0]
    fraction = (made.angles[:, [0, 2]] - made.angles[0, [0, 2]]) / way[[0, 2]]
    assert fraction[:, 0] == pytest.approx(fraction[:, 1])
    step = {"kind": "relative", "angles": {1: 0.1}}
    items = planned(step, step, step)
    assert [item.plans[0].angles[0, 0] for item in items[1:]] == [item.plans[0].angles[-1, 0] for item in items[:-1]]
    assert items[-1].plans[0].angles[-1, 0] == pytest.approx(REST[0] + 0.3, abs=0.01)
    (item,) = planned({"kind": "path", "path": PATH})
    approach, path = item.plans
    assert approach.angles[-1] == pytest.approx(path.angles[0])
    assert approach.angles[-1, 0] == pytest.approx(3.0, abs=0.0024)


def test_a_whole_program_is_carried_out_in_order() -> None:
    parsed = Program.model_validate(EVERYTHING)
    items = plan_program(parsed, MA2000, REST.tolist())
    assert check_program(items, MA2000, MA2000.limits) == []
    diary, told = Diary(input_on_after=27), list[str]()
    run_program(items, MA2000, diary, told.append)
    assert diary.entries == [
        "follow (1, 2)",
        "gripper True",
        "follow (2,)",
        "follow ()",
        "follow (1,)",
        "output 3 True",
        "observe 25",
        "observe 1",
        "observe 1",
    ]
    assert told[0] == "instruction 1 of 7: absolute"


def test_what_cannot_be_carried_out_ends_the_program_or_lets_it_not_begin() -> None:
    items = planned({"kind": "input", "line": 2, "on": True, "longest": 0.1}, {"kind": "gripper", "closed": True})
    diary = Diary(input_on_after=1000)
    with pytest.raises(TeachingError, match=r"instruction 1: input 2 was not on within 0\.1 s"):
        run_program(items, MA2000, diary, print)
    assert diary.periods == 5
    assert "gripper True" not in diary.entries
    items = planned({"kind": "relative", "angles": {1: 0.1}}, {"kind": "absolute", "angles": {2: -0.75}})
    (line,) = check_program(items, MA2000, MA2000.limits)
    assert line.startswith("instruction 2: end of link 3: height of -3")
    items = planned({"kind": "relative", "angles": {2: 0.5}, "speed": 2.5})
    assert check_program(items, MA2000, MA2000.limits)[0].startswith("instruction 1: joint 2: ")
    with pytest.raises(SpecError, match=r"program p: instruction 2: joint 4: start of 114\.59° is outside"):
        planned({"kind": "wait", "duration": 1}, {"kind": "absolute", "angles": {4: 2.0}})
    other = Program.model_validate(EVERYTHING | {"machine": "bench"})
    with pytest.raises(SpecError, match="it is for machine 'bench', this is 'ma2000'"):
        plan_program(other, MA2000, REST.tolist())


angles = st.dictionaries(st.integers(1, 6), st.floats(-6, 6), min_size=1)
instructions = st.one_of(
    st.fixed_dictionaries({"kind": st.sampled_from(["absolute", "relative"]), "angles": angles}),
    st.fixed_dictionaries({"kind": st.just("wait"), "duration": st.floats(0.01, 3600)}),
    st.fixed_dictionaries({"kind": st.just("output"), "line": st.integers(0, 7), "on": st.booleans()}),
    st.fixed_dictionaries({"kind": st.just("gripper"), "closed": st.booleans()}),
    st.just({"kind": "path", "path": PATH}),
)


@given(st.lists(instructions, min_size=1, max_size=5))
def test_a_program_comes_back_from_its_file_to_the_bit(parts: list[dict[str, object]]) -> None:
    made = program(*parts)
    assert parse_program(program_text(made)) == made


def test_a_saved_program_loads_as_it_was_and_toml_is_read_too(tmp_path: Path) -> None:
    made = Program.model_validate(EVERYTHING)
    save_program(made, tmp_path / "pick.json")
    assert load_program(tmp_path / "pick.json") == made
    assert [file.name for file in tmp_path.iterdir()] == ["pick.json"]
    file = tmp_path / "lift.toml"
    file.write_text('name = "lift"\n[[instructions]]\nkind = "relative"\nangles = { 2 = 0.2 }\n', "utf-8")
    assert load_program(file) == program({"kind": "relative", "angles": {2: 0.2}}).model_copy(update={"name": "lift"})
    with pytest.raises(SpecError, match=r"pick\.json: cannot be written: "):
        save_program(Program.model_validate(EVERYTHING), tmp_path / "no" / "pick.json")
    with pytest.raises(SpecError, match=r"pick\.json: cannot be read: "):
        load_program(tmp_path / "no" / "pick.json")
    assert all(math.isfinite(angle) for angle in REST)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("my postures.json", "program 'my postures': a name has"),
        ("-p.json", "program '-p': a name has"),
        ("no/pick.json", r"program .*no/pick\.json: its folder does not exist"),
    ],
)
def test_a_file_that_could_not_be_saved_is_refused_beforehand(tmp_path: Path, name: str, line: str) -> None:
    with pytest.raises(SpecError, match=line):
        require_program_file(tmp_path / name)
    require_program_file(tmp_path / "pick_2.json")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{", "p.json: program: Invalid JSON"),
        ('{"name": "p", "instructions": []}', "p.json: instructions: "),
        ('{"name": "p", "instructions": [{"kind": "dance"}]}', "p.json: instructions.1: .*'dance'"),
        ('{"name": "p", "instructions": [{"kind": "wait", "duration": 0}]}', "p.json: instructions.1.wait.duration: "),
        (
            '{"name": "p", "instructions": [{"kind": "absolute", "angles": {"7": 1}}]}',
            "p.json: instructions.1.absolute",
        ),
        (
            '{"name": "p", "instructions": [{"kind": "absolute", "angles": {}}]}',
            "p.json: instructions.1.absolute.angles",
        ),
    ],
)
def test_a_wrong_file_is_one_line_that_says_where(text: str, line: str) -> None:
    with pytest.raises(SpecError, match=f"^{line}") as caught:
        parse_program(text, "p.json")
    assert "\n" not in str(caught.value)
