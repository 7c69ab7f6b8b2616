"""A machine file with mistakes in it is refused with a line for each: where, the field, what was found, what is
allowed."""

from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import parse_machine

EXAMPLES = Path(__file__).parents[3] / "examples"
LIMIT = 'output_limit = "24 V"'


def refused(text: str) -> list[str]:
    """The lines that are said of a machine file."""
    with pytest.raises(SpecError) as caught:
        parse_machine(text, "my.toml")
    first, *more = str(caught.value).split("\n  ")
    assert first.startswith("my.toml: ")
    said = first.removeprefix("my.toml: ")
    assert not more or said == f"{len(more)} mistakes"
    return more or [said]


def complaint(name: str, wanted: str, given: str) -> str:
    """What is said of an example of which a part is written otherwise."""
    text = (EXAMPLES / f"{name}.toml").read_text("utf-8")
    assert wanted in text
    (line,) = refused(text.replace(wanted, given, 1))
    return line


@pytest.mark.parametrize(
    ("name", "wanted", "given", "said"),
    [
        ("line_stage", "N·s/m", "furlong", "joints.1.friction.viscous: unit is 'furlong', must be 'N·s/m', or one"),
        ("line_stage", "N·s/m", "N·m·s/rad", "unit is 'N·m·s/rad', must be 'N·s/m', or one that converts"),
        ("line_stage", "1.5 N", "1.5 stone·furlong", "joints.1.friction.coulomb: unit is 'stone·furlong', must be 'N'"),
        ("single_axis", '0.02 N·m"', '0.02 N"', "friction.coulomb: unit is 'N', must be 'N·m'"),
        (
            "single_axis",
            "N·m/V",
            "N·m/furlong",
            "joints.1.drive.gain: unit is 'N·m/furlong', must be 'N·m/V' or 'N·m/A'",
        ),
        (
            "single_axis",
            "0.5 N·m/V",
            "0.5",
            "joints.1.drive.gain: found '0.5', which has no unit: write N·m/V or N·m/A",
        ),
        ("single_axis", "kg·m²", "kg", "drive.inertia: unit is 'kg', must be 'kg·m²'"),
        ("line_stage", "5e-05 m", "5e-05 kg", "controller.set_point_resolution: unit is 'kg', must be 'rad' or 'm'"),
        ("line_stage", "5e-05 m", "5e-05 rad", "set_point_resolution: unit is 'rad', must be 'm' on these joints"),
        ("line_stage", LIMIT, LIMIT.replace("V", "hp"), "controller.output_limit: unit is 'hp', must be 'V' or 'A'"),
        ("line_stage", LIMIT, 'output_limit = ["24 A", "24 V"]', "controller.output_limit.1: unit is 'A', must be 'V'"),
        ("line_stage", LIMIT, 'output_limit = "a lot"', "output_limit: found 'a lot', must be a number like \"0.8 ±"),
        ("single_axis", '"5 ms"', '{ value = 5, unit = "kg", source = "" }', "period: unit is 'kg', must be 's'"),
        ("linear_axis", "0.6 m", "0.6 rad", "joints.1.sensor.range: unit is 'rad', must be 'm'"),
        ("line_stage", "8 ± 4 N·s/m", "8 ± -4 N·s/m", "friction.viscous: deviation -4.0 N·s/m is negative"),
        ("line_stage", '"1.8 ± 0.1 kg"', '"1.8 kg [2 to 3]"', "mass: value 1.8 kg is below its lower bound 2.0"),
    ],
)
def test_an_unknown_unit_is_refused_with_those_that_are_allowed(name: str, wanted: str, given: str, said: str) -> None:
    assert said in complaint(name, wanted, given)


def test_a_moving_mass_of_a_sliding_drive_may_be_in_kilograms_and_a_gain_may_leave_its_drive_open() -> None:
    text = (EXAMPLES / "linear_axis.toml").read_text("utf-8")
    gain = 'gain = "1 N/N"'
    assert gain in text
    drive = parse_machine(text.replace(gain, 'gain = "1 N", inertia = "400 g"')).joint(1)
    assert drive.drive_units == ("V", "A", "N·m", "N", "count", "%", "1")


@pytest.mark.parametrize(
    ("name", "wanted", "given", "said"),
    [
        (
            "line_stage",
            "output_limit",
            "outputlimit",
            "controller.outputlimit: there is no such field here; did you mean",
        ),
        (
            "single_axis",
            "viscous",
            "visc",
            "joints.1.friction.visc: there is no such field here; did you mean 'viscous'?",
        ),
        ("single_axis", "period =", "perod =", "controller.perod: there is no such field here; did you mean 'period'?"),
        ("single_axis", "{ mass", "{ zzz = 1, mass", "joints.1.link.zzz: there is no such field here (there are shape"),
        (
            "single_axis",
            'kind = "pid"',
            'kind = "pidd"',
            "controller: kind is 'pidd', must be one of 'board_pid', 'pid'",
        ),
        ("single_axis", 'kind = "pid"', 'colour = "red"', "controller: its kind is missing"),
        (
            "single_axis",
            'name = "axis"',
            'name = "axis"\nkind = "turning"',
            "joints.1.kind: found 'turning', must be 'revolute' or",
        ),
        ("single_axis", 'name = "single', 'version = 2\nname = "single', "version: found 2, must be 1"),
        ("single_axis", "[9.81, 0.0, 0.0]", "[9.81, 0.0]", "gravity.3: is missing"),
        ("single_axis", "[9.81, 0.0, 0.0]", "[9.81, 0.0, nan]", "gravity.3: found nan, must be a finite number"),
        ("single_axis", "[9.81, 0.0, 0.0]", "9.81", "gravity: found 9.81, must be a list"),
        (
            "single_axis",
            "gravity =",
            "modelled_joints = [1.5]\ngravity =",
            "modelled_joints.1: found 1.5, must be a whole",
        ),
        ("single_axis", "bits = 14", "bits = 99", "joints.1.sensor.bits: found 99, must be at most 32"),
        ("single_axis", "bits = 14", "bits = {}", "joints.1.sensor.bits: found a table, must be a whole number"),
        (
            "line_stage",
            LIMIT,
            'output_limit = { value = "x", unit = "V" }',
            "output_limit.value: found 'x', must be a num",
        ),
        (
            "line_stage",
            LIMIT,
            'output_limit = [{ value = 1.0, unit = "V" }]',
            "controller.output_limit has 1 numbers for 2 joints",
        ),
        ("single_axis", 'name = "single', 'name = "A single', "name: found 'A single-axis', must match ^[a-z0-9]"),
        ("pan_tilt", 'like = "pan"', 'like = "pa"', "joints.2.like: found 'pa', must be a joint before: pan"),
    ],
)
def test_the_field_what_was_found_and_what_is_allowed_are_told(name: str, wanted: str, given: str, said: str) -> None:
    assert said in complaint(name, wanted, given)


def test_a_file_without_joints_is_told_how_many_there_must_be() -> None:
    head = (EXAMPLES / "single_axis.toml").read_text("utf-8").partition("[[joints]]")[0]
    assert refused(f"joints = []\n{head}") == ["line 1: joints: has 0 entries, must have at least 1"]


def test_all_mistakes_of_a_file_are_told_at_once_in_the_order_of_its_lines() -> None:
    text = (EXAMPLES / "single_axis.toml").read_text("utf-8")
    for wanted, given in (("0.8 ±", "heavy ±"), ("bits = 14", "bits = 99"), ("kg·m²", "kg"), ("viscous", "visc")):
        text = text.replace(wanted, given, 1)
    lines = text.split("\n")
    said = refused(text)
    assert [line.split(": ")[1] for line in said] == [
        "joints.1.link.mass",
        "joints.1.drive.inertia",
        "joints.1.friction.visc",
        "joints.1.sensor.bits",
    ]
    for line, part in zip(said, ("heavy", "inertia", "visc", "bits = 99"), strict=True):
        assert part in lines[int(line.split(":")[0].removeprefix("line ")) - 1]
