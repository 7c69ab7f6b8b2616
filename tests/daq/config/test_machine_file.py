"""A machine file with a mistake in it is refused in one line: the field, what was found, what is allowed."""

from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import parse_machine

EXAMPLES = Path(__file__).parents[3] / "examples"
LIMIT = 'output_limit = { value = 24.0, unit = "V", source = "supply" }'


def complaint(name: str, wanted: str, given: str) -> str:
    """What is said of an example of which a part is written otherwise."""
    text = (EXAMPLES / f"{name}.toml").read_text("utf-8")
    assert wanted in text
    with pytest.raises(SpecError) as caught:
        parse_machine(text.replace(wanted, given, 1), "my.toml")
    said = str(caught.value)
    assert "\n" not in said
    assert said.startswith("my.toml: ")
    return said.removeprefix("my.toml: ")


@pytest.mark.parametrize(
    ("name", "wanted", "given", "said"),
    [
        ("line_stage", '"N·s/m"', '"furlong"', "joints.1: friction.viscous: unit is 'furlong', must be 'N·s/m' on a"),
        ("line_stage", '"N·s/m"', '"N·m·s/rad"', "unit is 'N·m·s/rad', must be 'N·s/m' on a joint that slides"),
        ("line_stage", 'unit = "N"', 'unit = "stone"', "joints.1: friction.coulomb: unit is 'stone', must be 'N' on a"),
        (
            "single_axis",
            'unit = "N·m"',
            'unit = "N"',
            "friction.coulomb: unit is 'N', must be 'N·m' on a joint that tu",
        ),
        ("single_axis", '"N·m/V"', '"N·m/furlong"', "joints.1: drive.gain: unit is 'N·m/furlong', must be N·m per uni"),
        ("single_axis", '"N·m/V"', '"N/V"', "such as 'N·m/V', on a joint that turns"),
        ("single_axis", '"kg·m²"', '"kg"', "drive.inertia: unit is 'kg', must be 'kg·m²' on a joint that turns"),
        (
            "line_stage",
            '5e-5, unit = "m"',
            '5e-5, unit = "rad"',
            "controller.set_point_resolution: unit is 'rad', must",
        ),
        (
            "line_stage",
            LIMIT,
            LIMIT.replace("V", "hp"),
            "controller.output_limit: unit is 'hp', must be 'V' on these jo",
        ),
        (
            "line_stage",
            LIMIT,
            "output_limit = [{L}, {L}]".replace("{L}", LIMIT[15:].replace("V", "A")),
            "limit.1: unit is 'A'",
        ),
        (
            "single_axis",
            'period = { value = 0.005, unit = "s"',
            'period = { value = 5, unit = "ms"',
            "period: unit is 'ms'",
        ),
        (
            "linear_axis",
            '0.6, unit = "m"',
            '0.6, unit = "rad"',
            "joints.1: sensor.range: unit is 'rad', must be 'm' on a",
        ),
    ],
)
def test_an_unknown_unit_is_refused_with_those_that_are_allowed(name: str, wanted: str, given: str, said: str) -> None:
    assert said in complaint(name, wanted, given)


def test_a_moving_mass_of_a_sliding_drive_may_be_in_kilograms_and_a_gain_may_leave_its_drive_open() -> None:
    text = (EXAMPLES / "linear_axis.toml").read_text("utf-8")
    gain = 'gain = { value = 1.0, unit = "N/N", source = "the force is recorded" }'
    assert gain in text
    with_mass = f'{gain.replace("N/N", "N")}, inertia = {{ value = 0.4, unit = "kg", source = "scales" }}'
    drive = parse_machine(text.replace(gain, with_mass)).joint(1)
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
        (
            "single_axis",
            "mass = {",
            "mass = { zzz = 1,",
            "joints.1.link.mass.zzz: there is no such field here (there are v",
        ),
        (
            "single_axis",
            'kind = "pid"',
            'kind = "pidd"',
            "controller: kind is 'pidd', must be one of 'board_pid', 'pid'",
        ),
        ("single_axis", 'kind = "pid"', 'colour = "red"', "controller: its kind is missing"),
        ("single_axis", '"revolute"', '"turning"', "joints.1.kind: found 'turning', must be 'revolute' or 'prismatic'"),
        ("single_axis", "version = 1", "version = 2", "version: found 2, must be 1"),
        ("single_axis", "[9.81, 0.0, 0.0]", "[9.81, 0.0]", "gravity.3: is missing"),
        ("single_axis", "[9.81, 0.0, 0.0]", "[9.81, 0.0, nan]", "gravity.3: found nan, must be a finite number"),
        ("single_axis", "[9.81, 0.0, 0.0]", "9.81", "gravity: found 9.81, must be a list"),
        (
            "single_axis",
            "modelled_joints = [1]",
            "modelled_joints = [1.5]",
            "modelled_joints.1: found 1.5, must be a whole",
        ),
        ("single_axis", "bits = 14", "bits = 99", "joints.1.sensor.bits: found 99, must be at most 32"),
        ("single_axis", "bits = 14", "bits = {}", "joints.1.sensor.bits: found a table, must be a whole number"),
        ("line_stage", LIMIT, "output_limit = 24.0", "controller.output_limit: found 24.0, must be a table"),
        (
            "line_stage",
            LIMIT,
            'output_limit = { value = "x", unit = "V" }',
            "output_limit.value: found 'x', must be a num",
        ),
        ("line_stage", LIMIT, 'output_limit = [{ value = 1.0, unit = "V" }]', "output_limit.1.source: is missing"),
        ("single_axis", 'name = "single', 'name = "A single', "name: found 'A single-axis', must match ^[a-z0-9]"),
    ],
)
def test_the_field_what_was_found_and_what_is_allowed_are_told(name: str, wanted: str, given: str, said: str) -> None:
    assert said in complaint(name, wanted, given)


def test_a_file_without_joints_is_told_how_many_there_must_be() -> None:
    head = (EXAMPLES / "single_axis.toml").read_text("utf-8").partition("[[joints]]")[0]
    with pytest.raises(SpecError, match=r"^my.toml: joints: has 0 entries, must have at least 1$"):
        parse_machine(f"joints = []\n{head}", "my.toml")
