"""A machine file in full and in the words of a data sheet; a line for each mistake in it."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.config.machine_text import machine_text
from daq.config.tidied_machine import tidied
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, load_machine, parse_machine
from daq.contracts.toml_places import places_of
from daq.contracts.written_numbers import read_number

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


def complaint(name: str, wanted: str, written: str) -> str:
    """What is said of an example of which a part is written otherwise."""
    text = (EXAMPLES / f"{name}.toml").read_text("utf-8")
    assert wanted in text
    (line,) = refused(text.replace(wanted, written, 1))
    return line


AXIS, STAGE = "single_axis", "line_stage"


@pytest.mark.parametrize(
    ("name", "wanted", "written", "said"),
    [
        (STAGE, "N·s/m", "furlong", "joints.1.friction.viscous: unit is 'furlong', must be 'N·s/m', or one"),
        (STAGE, "N·s/m", "N·m·s/rad", "unit is 'N·m·s/rad', must be 'N·s/m', or one that converts"),
        (STAGE, "1.5 N", "1.5 stone·furlong", "joints.1.friction.coulomb: unit is 'stone·furlong', must be 'N'"),
        (AXIS, '0.02 N·m"', '0.02 N"', "friction.coulomb: unit is 'N', must be 'N·m'"),
        (AXIS, "N·m/V", "N·m/furlong", "joints.1.drive.gain: unit is 'N·m/furlong', must be 'N·m/V' or 'N·m/A'"),
        (AXIS, "0.5 N·m/V", "0.5", "joints.1.drive.gain: found '0.5', which has no unit: write N·m/V or N·m/A"),
        (AXIS, "kg·m²", "kg", "drive.inertia: unit is 'kg', must be 'kg·m²'"),
        (STAGE, "5e-05 m", "5e-05 kg", "controller.set_point_resolution: unit is 'kg', must be 'rad' or 'm'"),
        (STAGE, "5e-05 m", "5e-05 rad", "set_point_resolution: unit is 'rad', must be 'm' on these joints"),
        (STAGE, LIMIT, LIMIT.replace("V", "hp"), "controller.output_limit: unit is 'hp', must be 'V' or 'A'"),
        (STAGE, LIMIT, 'output_limit = ["24 A", "24 V"]', "controller.output_limit.1: unit is 'A', must be 'V'"),
        (STAGE, LIMIT, 'output_limit = "a lot"', "output_limit: found 'a lot', must be a number like \"0.8 ±"),
        (AXIS, '"5 ms"', '{ value = 5, unit = "kg", source = "" }', "period: unit is 'kg', must be 's'"),
        ("linear_axis", "0.6 m", "0.6 rad", "joints.1.sensor.range: unit is 'rad', must be 'm'"),
        (STAGE, "8 ± 4 N·s/m", "8 ± -4 N·s/m", "friction.viscous: deviation -4.0 N·s/m is negative"),
        (STAGE, '"1.8 ± 0.1 kg"', '"1.8 kg [2 to 3]"', "mass: value 1.8 kg is below its lower bound 2.0"),
    ],
)
def test_an_unknown_unit_is_refused_with_the_allowed_ones(name: str, wanted: str, written: str, said: str) -> None:
    assert said in complaint(name, wanted, written)


def test_a_moving_mass_of_a_sliding_drive_may_be_in_kilograms_and_a_gain_may_leave_its_drive_open() -> None:
    text = (EXAMPLES / "linear_axis.toml").read_text("utf-8")
    gain = 'gain = "1 N/N"'
    assert gain in text
    drive = parse_machine(text.replace(gain, 'gain = "1 N", inertia = "400 g"')).joint(1)
    assert drive.drive_units == ("V", "A", "N·m", "N", "count", "%", "1")


@pytest.mark.parametrize(
    ("name", "wanted", "written", "said"),
    [
        (STAGE, "output_limit", "outputlimit", "controller.outputlimit: there is no such field here; did you mean"),
        (AXIS, "viscous", "visc", "joints.1.friction.visc: there is no such field here; did you mean 'viscous'?"),
        (AXIS, "period =", "perod =", "controller.perod: there is no such field here; did you mean 'period'?"),
        (AXIS, "{ mass", "{ zzz = 1, mass", "joints.1.link.zzz: there is no such field here (there are shape"),
        (AXIS, 'kind = "pid"', 'kind = "pidd"', "controller: kind is 'pidd', must be one of 'board_pid', 'pid'"),
        (AXIS, 'kind = "pid"', 'colour = "red"', "controller: its kind is missing"),
        (
            AXIS,
            'name = "axis"',
            'name = "axis"\nkind = "turning"',
            "joints.1.kind: found 'turning', must be 'revolute' or",
        ),
        (AXIS, 'name = "single', 'version = 2\nname = "single', "version: found 2, must be 1"),
        (AXIS, "[9.81, 0.0, 0.0]", "[9.81, 0.0]", "gravity.3: is missing"),
        (AXIS, "[9.81, 0.0, 0.0]", "[9.81, 0.0, nan]", "gravity.3: found nan, must be a finite number"),
        (AXIS, "[9.81, 0.0, 0.0]", "9.81", "gravity: found 9.81, must be a list"),
        (AXIS, "gravity =", "modelled_joints = [1.5]\ngravity =", "modelled_joints.1: found 1.5, must be a whole"),
        (AXIS, "bits = 14", "bits = 99", "joints.1.sensor.bits: found 99, must be at most 32"),
        (AXIS, "bits = 14", "bits = {}", "joints.1.sensor.bits: found a table, must be a whole number"),
        (STAGE, LIMIT, 'output_limit = { value = "x", unit = "V" }', "output_limit.value: found 'x', must be a num"),
        (
            STAGE,
            LIMIT,
            'output_limit = [{ value = 1.0, unit = "V" }]',
            "controller.output_limit has 1 numbers for 2 joints",
        ),
        (AXIS, 'name = "single', 'name = "A single', "name: found 'A single-axis', must match ^[a-z0-9]"),
        ("pan_tilt", 'like = "pan"', 'like = "pa"', "joints.2.like: found 'pa', must be a joint before: pan"),
    ],
)
def test_the_field_what_was_found_and_what_is_allowed_are_told(name: str, wanted: str, written: str, said: str) -> None:
    assert said in complaint(name, wanted, written)


def test_all_mistakes_of_a_file_are_told_at_once_in_the_order_of_its_lines() -> None:
    text = (EXAMPLES / "single_axis.toml").read_text("utf-8")
    for wanted, written in (("0.8 ±", "heavy ±"), ("bits = 14", "bits = 99"), ("kg·m²", "kg"), ("viscous", "visc")):
        text = text.replace(wanted, written, 1)
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
    head = (EXAMPLES / "single_axis.toml").read_text("utf-8").partition("[[joints]]")[0]
    assert refused(f"joints = []\n{head}") == ["line 1: joints: has 0 entries, must have at least 1"]


# ---- A machine file in the words of a data sheet

ROOT = Path(__file__).parents[3]
FILES = sorted([*ROOT.glob("examples/*.toml"), *ROOT.glob("daq/contracts/machines/*.toml")])
SHORT = """
name = "rod"
[[joints]]
name = "axis"
link = { mass = "0.8 ± 10 % kg", centre = ["-150 mm", 0.0, 0.0] }  # scales
drive = { resistance = "2 ohm", torque_constant = "5 N·cm/A", supply_limit = "12 V" }  # data sheet
sensor = "14 bits"
"""


@pytest.mark.parametrize(
    ("written", "allowed", "value"),
    [
        ("160 mm", ("m",), 0.16),
        ("90 deg", ("rad", "m"), 1.5707963267948966),
        ("25 kg·cm", ("N·m",), 2.4516625),
        ("25 kg-cm", ("N·m",), 2.4516625),
        ("100 oz-in", ("N·m",), 0.7061551814226),
        ("8 lb·in", ("N·m",), 0.903878632221),
        ("60 rpm/V", ("V·s/rad",), 0.159154943091895),
        ("8 V/krpm", ("V·s/rad",), 0.0763943726841),
        ("0.3 kgf·cm/A", ("N·m/A",), 0.02941995),
        ("12 mNm/A", ("N·m/A",), 0.012),
        ("30 gcm²", ("kg·m²",), 3e-6),
        ("30 g*cm^2", ("kg·m²",), 3e-6),
        ("0.82 mH", ("H",), 0.00082),
        ("-0.5", ("1",), -0.5),
        ("−1.5e-2 m", ("m",), -0.015),
    ],
)
def test_units_of_data_sheets_are_converted(written: str, allowed: tuple[str, ...], value: float) -> None:
    found = read_number(written, "", allowed)
    assert found["value"] == pytest.approx(value, rel=1e-12)
    assert found["unit"] == allowed[0]


def test_deviation_bounds_and_source_are_read_with_the_number() -> None:
    found = read_number("6 ± 2 ms [0 to 20], assumed: computing time", "ignored", ("s",))
    assert found == {
        "value": 0.006,
        "deviation": 0.002,
        "low": 0.0,
        "high": 0.02,
        "unit": "s",
        "source": "computing time",
        "assumed": True,
    }
    assert read_number("60 rpm/V ± 10 %", "comment", ("V·s/rad",))["deviation"] == pytest.approx(0.0159154943)
    assert read_number("5 ± 1 %", "", ("%",))["deviation"] == 1.0
    assert read_number("160 mm ± 1 mm", "", ("m",))["deviation"] == 0.001
    assert read_number(0.8, "guess", ("kg",)) == {"value": 0.8, "unit": "kg", "source": "guess", "assumed": True}


@pytest.mark.parametrize(
    ("written", "allowed"),
    [
        ("12 V/rad", ("V",)),
        ("10 deg", ("V", "A", "1")),
        ("1 count", ("rad", "m")),
        ("1 kg", ("N·m",)),
        ("0 rpm/V", ("V·s/rad",)),
        ("3", ("rad", "m")),
        ("eight kg", ("kg",)),
        ("160 mm ± 1 m", ("m",)),
    ],
)
def test_what_is_no_such_quantity_is_refused(written: str, allowed: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match=r"unit|number|reciprocal"):
        read_number(written, "", allowed)


@pytest.mark.parametrize(
    "written", ["0,8 kg", "1.200,5 kg", "0.8 ± 0,08 kg, scales", "0.8 kg [0,5 to 1]", "1 200 kg", "330 rpm/V"]
)
def test_how_a_data_sheet_writes_it_is_told(written: str) -> None:
    told = "written as back_emf_constant" if "rpm" in written else "write decimals with a point"
    with pytest.raises(ValueError, match=told):
        read_number(written, "", ("N·m/A",) if "rpm" in written else ("kg",))


def test_what_a_file_leaves_out_is_zero_or_the_usual_and_the_comment_is_the_source() -> None:
    machine = parse_machine(SHORT)
    joint, motor = machine.joint(1), machine.joint(1).dc_motor
    assert (machine.title, machine.modelled_joints, machine.controller.kind) == ("rod", (1,), "none")
    assert (joint.kind, joint.geometry.a.value, joint.link.shape) == ("revolute", 0.0, "body")
    assert joint.link.mass.deviation == pytest.approx(0.08)
    assert joint.link.mass.source == "scales"
    assert (motor.torque_constant.value, motor.back_emf_constant.value) == (0.05, 0.05)
    assert (motor.dac_full_scale.value, motor.gear_ratio.value, motor.inductance.assumed) == (12.0, 1.0, True)
    assert joint.sensor is not None
    assert joint.sensor.at_zero.value == pytest.approx(-3.14159265)
    text = SHORT.replace('torque_constant = "5 N·cm/A"', 'back_emf_constant = "100 rpm/V ± 5 %"')
    motor = parse_machine(text).joint(1).dc_motor
    assert motor.torque_constant.value == pytest.approx(0.0954929659)
    assert motor.torque_constant.deviation == pytest.approx(0.05 * 0.0954929659)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_machine_is_written_and_read_back_as_it_was(path: Path) -> None:
    machine = load_machine(str(path))
    again = parse_machine(machine_text(machine))
    assert numbers(again) == numbers(machine)
    assert machine_text(again) == machine_text(machine)


def test_a_file_is_written_as_tidying_leaves_it() -> None:
    # What is short stays as it is, with the library's names and every comment; what is long beside it gets shorter
    short = """name = "head"
controller = { kind = "servo", gains = [800, 0, 0] }  # the wizard's
[[joints]]
name = "pan"  # the turntable
drive = "robotis/xm430-w350"
link = { mass = "0.15 kg", radius = "40 mm" }# kitchen scales
[[joints]]
name = "tilt"
drive = "robotis/xm430-w350"
link = { mass = "0.1 kg" }
"""
    assert tidied(short, "head.toml") == short
    long = short.replace('"0.1 kg"', '{ value = 0.1, unit = "kg", source = "scales" }')
    assert tidied(long, "head.toml") == short.replace('"0.1 kg" }', '"0.1 kg" }  # scales')
    for path in (*EXAMPLES.glob("*.toml"), *(ROOT / "daq" / "contracts" / "machines").glob("*.toml")):
        if "[[joints]]" in (text := path.read_text("utf-8")):
            assert tidied(text, path.name) == text
    old = """# A rod.
version = 1
name = "rod"
title = "rod"
gravity = [0.0, 0.0, -9.81]
modelled_joints = [1]
controller = { kind = "none" }
[[joints]]
# Weighed twice.
name = "axis"
kind = "revolute"
geometry = { a = { value = 0.3, unit = "m", source = "ruler" }, alpha = { value = 0.0, unit = "rad", source = "planar" }, d = { value = 0.0, unit = "m", source = "planar" }, theta = { value = 0.0, unit = "rad", source = "down" } }
link = { shape = "rod", mass = { value = 0.8, unit = "kg", source = "scales", low = 0.0, deviation = 0.08 } }
drive = { kind = "gain", gain = { value = 0.5, unit = "N·m/V", source = "data sheet" } }
"""  # noqa: E501
    assert tidied(old, "rod.toml").splitlines() == [
        "# A rod.",
        'name = "rod"',
        "[[joints]]",
        "# Weighed twice.",
        'name = "axis"',
        'geometry = { a = "0.3 m" }  # ruler',
        'link = { mass = "0.8 ± 0.08 kg" }  # scales',
        'drive = { gain = "0.5 N·m/V" }  # data sheet',
    ]
    with pytest.raises(SpecError, match=r"my.toml: line 1: colour: there is no such field"):
        tidied(f'colour = "red"\n{old}', "my.toml")


KEYS = st.text(st.sampled_from("ab-_\"' .#"), min_size=1, max_size=3)
VALUES = st.recursive(
    st.sampled_from(["1", "-2.5", "true", '"#a\\"]"', "'b}'", '"""c\n\n#"""', "1979-05-27T07:32:00Z"]),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda parts: "[\n# comment\n" + ",\n".join(parts) + "\n]"),
        st.dictionaries(st.sampled_from("xyz"), inner, max_size=3).map(
            lambda table: f"{{ {', '.join(f'{k} = {v}' for k, v in table.items())} }}"
        ),
    ),
    max_leaves=6,
)


@given(st.dictionaries(KEYS, VALUES, max_size=4), st.lists(st.dictionaries(KEYS, VALUES, max_size=2), max_size=3))
def test_places_are_those_of_every_value_that_tomllib_reads(table: dict[str, str], rows: list[dict[str, str]]) -> None:
    def lines(entries: dict[str, str]) -> list[str]:
        return [f"{_quoted(key)} = {value} # behind" for key, value in entries.items()]

    text = "\n".join([*lines(table), *(line for row in rows for line in ("[[rows_]]", *lines(row)))])
    data = tomllib.loads(text)
    places = places_of(text)
    assert set(places.lines) == {path for path in paths(data) if path not in {(), ("rows_",)}}
    assert all(1 <= line <= text.count("\n") + 1 for line in places.lines.values())


def _quoted(key: str) -> str:
    return '"' + key.replace('"', '\\"') + '"'


def paths(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    yield path
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from paths(value, (*path, key))


def numbers(machine: Machine) -> dict[str, Any]:
    """A machine without sources, and without bounds that go without saying."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            kept = {k: plain(v) for k, v in value.items() if k not in ("source", "assumed")}
            return kept | {"low": None} if kept.get("low") == 0.0 and "value" in kept and kept["high"] is None else kept
        return [plain(one) for one in value] if isinstance(value, list | tuple) else value

    found = plain(machine.model_dump())
    assert isinstance(found, dict)
    return found
