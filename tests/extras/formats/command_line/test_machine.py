"""`daq machine`: URDF in, URDF and MJCF out, as a person types it."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.machine import Body, Machine, PlainGain, SampledPid, load_machine
from tests.daq_cli.hostile import FILES, hostile_file, refuses
from tests.daq_cli.invoke import CommandLine

Floats = NDArray[np.float64]
EXAMPLE = Path(__file__).parents[4] / "examples" / "reach_arm.urdf"


@pytest.fixture
def urdf() -> str:
    return str(shutil.copy(EXAMPLE, "arm.urdf"))


@pytest.mark.parametrize("kind", FILES)
def test_a_file_that_is_no_urdf_is_refused_in_one_line(daq: CommandLine, kind: str) -> None:
    refuses(daq("machine", "new", "--urdf", hostile_file(kind, ".urdf")))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--joints turn,,lift", "--joints 'turn,,lift': write names like shoulder,elbow"),
        ("--joints turn,wrist", "has no joint 'wrist' that moves; it has turn, lift, reach"),
        ("", "joint 'right_finger' mimics another; name the arm's independent joints"),
        ("--joints turn --hold lift", "--hold 'lift': write joint=position pairs"),
        ("--joints turn --hold lift=up", "--hold lift 'up': write a number"),
        ("--joints turn --gravity 0,0", "--gravity '0,0': write 3 numbers, separated by commas"),
        ("--joints turn --drives nothing.toml", "machine 'nothing.toml': no such file"),
        ("--joints turn,lift --drives 1N·m/A,1N·m/A,1N·m/A", "--drives names 3, but there are 2 joints"),
        ("--joints reach --drives 1N·m/A", "drive: unit is 'N·m/A', must be 'N/V'"),
        ("--joints turn --drives ma2000", "drives of ma2000: none of its joints (waist, shoulder"),
        ("Turn --joints turn", "arm.urdf: name: found 'Turn', must match"),
        ("--joints turn -o arm.urdf", "arm.urdf: already exists; name another file with -o"),
    ],
)
def test_wrong_input_is_refused_in_one_line(daq: CommandLine, urdf: str, words: str, said: str) -> None:
    daq("machine", "new", "--urdf", urdf, *words.split()).complains(2, said)


def test_json_tells_file_joints_and_notes(daq: CommandLine, urdf: str) -> None:
    said = daq("machine", "new", "--urdf", urdf, "--joints", "lift,reach", "--gravity", "9.81,0,0", "--json")
    answer = json.loads(said.out)
    assert (answer["file"], answer["machine"], answer["joints"]) == ("reach-arm.toml", "reach-arm", ["lift", "reach"])
    assert "Held: turn at 0, left_finger at 0, right_finger at 0." in answer["notes"]
    machine = load_machine("reach-arm.toml")
    assert sorted(map(abs, machine.gravity)) == pytest.approx([0.0, 0.0, 9.81], abs=1e-12)
    outgoing = json.loads(daq("machine", "to-mjcf", "reach-arm.toml", "--json").out)
    assert outgoing["mjcf"].startswith('<mujoco model="reach-arm">')
    assert outgoing["left_out"] == []
    assert outgoing["file"] is None


def test_text_goes_to_standard_output_unless_a_file_is_named(daq: CommandLine) -> None:
    said = daq("machine", "to-urdf", "ma2000")
    assert said.out.startswith("<?xml version='1.0' encoding='utf-8'?>\n<robot name=\"ma2000\">")
    assert said.err.startswith(
        "left out: load-dependent friction on joints 1, 2 and 3; sensors; controller; inertia of drives"
    )
    assert daq("machine", "to-urdf", "ma2000", "-o", "out.urdf").out == "out.urdf\n"
    assert Path("out.urdf").read_text("utf-8") == said.out
    daq("machine", "to-urdf", "ma2000", "-o", "nowhere/out.urdf").complains(2, "there is no folder")
    daq("machine", "to-mjcf", "nothing.json").complains(2, "nothing.json")


ANSWERS = """\
pan,tilt
robotis/xm430
robotis/xm430-w350
150 g ± 10 %
40 furlong·kg
40 mm
across
crossed

0.12 kg
160 mm
"""
"""Of joint 1: drive, length and axis are once wrong; of joint 2 the drive is not known."""


def test_what_is_asked_becomes_the_file() -> None:
    program = "import sys; from daq_cli.app.command import main; main(sys.argv[1:])"
    done = subprocess.run(
        [sys.executable, "-c", program, "machine", "new", "pan-tilt"],
        input=ANSWERS,
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONPATH": str(EXAMPLE.parents[1])},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "drive 'robotis/xm430' is not in the library; did you mean" in done.stderr
    assert "unit is 'furlong·kg', must be 'm'" in done.stderr
    assert "'across': answer parallel or crossed" in done.stderr
    assert "Measure first, because their deviations change the torques most:" in done.stderr
    assert Path("pan-tilt.toml").read_text("utf-8").splitlines() == [
        'name = "pan-tilt"',
        'notes = "Assumed: gravity acts along the first axis (--gravity 0,-9.81,0: across it)."',
        "",
        "[[joints]]",
        'name = "pan"',
        'geometry = { a = "40 mm", alpha = "90 deg" }',
        'link = { mass = "150 g ± 10 %" }',
        'drive = "robotis/xm430-w350"',
        "",
        "[[joints]]",
        'name = "tilt"',
        'geometry = { a = "160 mm" }',
        'link = { mass = "0.12 kg" }',
        'drive = { gain = "1 N·m/V ± 50 %, assumed: nothing is known of it" }',
        'friction = { viscous = "0 ± 0.1 N·m·s/rad, guess", coulomb = "0 ± 0.1 N·m, guess" }',
    ]


def test_names_of_servos_make_a_file_and_say_what_to_measure(daq: CommandLine) -> None:
    said = daq("machine", "new", "head", "--joints", "pan,tilt", "--drives", "feetech/sts3215-7.4V", "--json")
    answer = json.loads(said.out)
    machine = load_machine("head.toml")
    assert [joint.name for joint in machine.joints] == ["pan", "tilt"]
    assert machine.controller.kind == "pid"
    assert len(answer["sharpest"]) == 3
    assert answer["defaults"][0] == "controller.delay 0 s"
    daq("machine", "new").complains(2, "give a name, or --urdf and a file")


def test_the_gain_of_unknown_drives_is_that_of_a_record(daq: CommandLine, urdf: str) -> None:
    """Currents of 0.25 A per N·m of the load's weight, as a record of the turned arm shows them."""
    time = 0.01 * np.arange(2000)
    lift = 0.45 + 0.6 * np.sin(0.4 * time)
    daq("machine", "new", "--urdf", urdf, "--joints", "lift", "-o", "lift.toml")
    friction = 0.5 * np.sign(np.cos(0.4 * time))
    current = 0.25 * (weight_of(load_machine("lift.toml"), lift) + friction)
    table = [f"{t:.2f},{q:.6f},{i:.6f}" for t, q, i in zip(time, lift, current, strict=True)]
    Path("run.csv").write_text("\n".join(["time,position_1,drive_1", *table, ""]), "utf-8")
    Path("run.toml").write_text('drive_unit = "A"\n', "utf-8")
    said = daq("machine", "new", "--urdf", urdf, "--joints", "lift", "--record", "run.csv", "-o", "driven.toml")
    gain = load_machine("driven.toml").joint(1).drive
    assert isinstance(gain, PlainGain)
    assert gain.gain.unit == "N·m/A"
    assert gain.gain.value == pytest.approx(4.0, rel=0.03)
    assert "it explains" in gain.gain.source
    assert said.code == 0


def weight_of(machine: Machine, angles: Floats) -> Floats:
    """Torque that holds one turning body against gravity, by its Denavit-Hartenberg parameters."""
    joint = machine.joint(1)
    assert isinstance(joint.link, Body)
    alpha, a, d = joint.geometry.alpha.value, joint.geometry.a.value, joint.geometry.d.value
    x, y, z = (c.value for c in joint.link.centre)
    own = np.array([a + x, np.cos(alpha) * y - np.sin(alpha) * z, d + np.sin(alpha) * y + np.cos(alpha) * z])
    turn = angles + joint.geometry.theta.value
    east = np.cos(turn) * own[0] - np.sin(turn) * own[1]
    north = np.sin(turn) * own[0] + np.cos(turn) * own[1]
    return np.asarray(-joint.link.mass.value * (east * machine.gravity[1] - north * machine.gravity[0]))


def test_a_file_is_tidied_where_it_lies_or_elsewhere(daq: CommandLine) -> None:
    shutil.copy(EXAMPLE.parent / "pan_tilt.toml", "mine.toml")
    before = Path("mine.toml").read_text("utf-8")
    assert daq("machine", "tidy", "mine.toml", "-o", "other.toml").out == "other.toml\n"
    assert Path("other.toml").read_text("utf-8") == before
    said = daq("machine", "tidy", "mine.toml")
    assert (said.out, said.err) == ("", "mine.toml: nothing in it gets shorter\n")
    assert daq("check", "mine.toml").out == "mine.toml: no mistakes in machine pan_tilt with joints pan, tilt\n"
    Path("mine.csv").write_text("a\n1\n", "utf-8")
    for name in ("mine.csv", "mine.toml"):
        daq("check", name, "--model", "ma2000").complains(2, "mine.toml: is a machine file, for --model; a TOML of")
    Path("mine.toml").write_text(before.replace("bits = 12", "bits = 99"), "utf-8")
    daq("machine", "tidy", "mine.toml").complains(2, "joints.1.sensor.bits: found 99, must be at most 32")
    # Each of several mistakes has a line of its own, and none of it is left out
    many = "".join(f"colour_{k} = 1\n" for k in range(30))
    Path("mine.toml").write_text(many + before, "utf-8")
    said = daq("check", "mine.toml")
    assert (said.code, said.err.count("\n"), "…" in said.err) == (2, 31, False)
    assert re.findall(r"^  line (\d+): ", said.err, re.MULTILINE) == [str(k + 1) for k in range(30)]


def test_drives_are_listed_and_one_is_shown_with_its_numbers(daq: CommandLine) -> None:
    assert len(daq("machine", "drives").out.splitlines()) >= 25
    assert "drive.torque_constant = 0.115 N·m/A ± 15 %" in daq("machine", "drives", "ak80-9").out
    daq("machine", "drives", "nobody").complains(2, "no drive has 'nobody' in its name")


def test_the_page_s_dynamixels_make_a_machine(daq: CommandLine) -> None:
    section = (EXAMPLE.parents[1] / "docs" / "any-arm.md").read_text("utf-8").partition("## My Dynamixels")[2]
    (command,) = re.findall(r"^daq (machine new .*)$", section.partition("## My Franka")[0], re.MULTILINE)
    said = daq(*command.split())
    assert (said.code, "axes are parallel (alpha = '90 deg' in a joint's geometry" in said.err) == (0, True)
    assert len([line for line in Path("head.toml").read_text("utf-8").splitlines() if line]) == 12
    assert daq(*command.replace("new head", "new across").split(), "--gravity", "0,-9.81,0").code == 0
    assert load_machine("across.toml").gravity == (0.0, -9.81, 0.0)
    written = re.findall(r"```toml\n(.*?)```", section, re.DOTALL)[0]
    Path("own.toml").write_text(f'name = "own"\n{written}link = {{ mass = "0.15 kg", radius = "40 mm" }}\n', "utf-8")
    controller = load_machine("own.toml").controller
    assert isinstance(controller, SampledPid)
    assert controller.gains[0][0] == pytest.approx(55.2456 * 11.1 / 12.0, rel=1e-3)
