"""`daq machine`: URDF in, URDF and MJCF out, as a person types it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from tests.daq_cli.hostile import FILES, hostile_file, refuses
from tests.daq_cli.invoke import CommandLine

EXAMPLE = Path(__file__).parents[4] / "examples" / "reach_arm.urdf"


@pytest.fixture
def urdf() -> str:
    return str(shutil.copy(EXAMPLE, "arm.urdf"))


@pytest.mark.parametrize("kind", FILES)
def test_a_file_that_is_no_urdf_is_refused_in_one_line(daq: CommandLine, kind: str) -> None:
    refuses(daq("machine", "from-urdf", hostile_file(kind, ".urdf")))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--joints turn,,lift", "--joints 'turn,,lift': write names like shoulder,elbow"),
        ("--joints turn,wrist", "has no joint 'wrist' that moves; it has turn, lift, reach"),
        ("", "joint 'right_finger' mimics another; name the arm's joints"),
        ("--joints turn,right_finger", "joint 'right_finger' mimics 'left_finger'; a model's joints are independent"),
        ("--joints turn,left_finger", "joint 'right_finger' mimics 'left_finger', which moves"),
        ("--joints turn --hold lift", "--hold 'lift': write joint=position pairs"),
        ("--joints turn --hold lift=up", "--hold lift 'up': write a number"),
        ("--joints turn --hold lift=1e999", "--hold lift '1e999': write a number"),
        ("--joints turn --hold turn=1", "--hold turn=1.0: it is one of the joints that move"),
        ("--joints turn --gravity 0,0", "--gravity '0,0': write 3 numbers, separated by commas"),
        ("--joints turn --tip foot", "--tip foot: is no link that the last joint carries; it carries column, boom"),
        ("--joints turn --drives nothing.toml", "machine 'nothing.toml': no such file"),
        ("--joints turn --drives ma2000", "drives of ma2000: none of its joints (waist, shoulder"),
        ("--joints turn --name Turn", "arm.urdf: name: found 'Turn', must match"),
        ("--joints turn -o arm.urdf", "arm.urdf: is there already; name another file with -o"),
        ("--joints turn -o there/arm.toml", "there is no folder"),
    ],
)
def test_wrong_input_is_refused_in_one_line(daq: CommandLine, urdf: str, words: str, said: str) -> None:
    daq("machine", "from-urdf", urdf, *words.split()).complains(2, said)


def test_json_tells_file_joints_and_notes(daq: CommandLine, urdf: str) -> None:
    said = daq("machine", "from-urdf", urdf, "--joints", "lift,reach", "--gravity", "9.81,0,0", "--json")
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
        "left out: load_dependent_friction (joint 1, 2, 3); sensors; controller; inertia of drives"
    )
    assert daq("machine", "to-urdf", "ma2000", "-o", "out.urdf").out == "out.urdf\n"
    assert Path("out.urdf").read_text("utf-8") == said.out
    daq("machine", "to-urdf", "ma2000", "-o", "nowhere/out.urdf").complains(2, "there is no folder")
    daq("machine", "to-mjcf", "nothing.json").complains(2, "nothing.json")


ANSWERS = """\
0.4

current
0.05
zero
100
1e-5


weird
other
volts
V
2.5
0.01
"""
"""Of joint turn: viscous, no Coulomb, a current with constant, gear (once wrong) and rotor; of lift: gains in volts."""


def test_what_is_asked_becomes_part_of_the_file(urdf: str) -> None:
    program = "import sys; from daq_cli.app.command import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", program, "machine", "from-urdf", urdf, "--joints", "turn,lift", "--ask"]
    environment = os.environ | {"PYTHONPATH": str(EXAMPLE.parents[1])}
    done = subprocess.run(
        command, input=ANSWERS, capture_output=True, text=True, timeout=60, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "1 'zero': write a number" in done.stderr
    assert "'weird': answer torque, current, other, or Enter" in done.stderr
    assert "'volts': answer V, A, N·m, N, count, %, 1, or Enter for V" in done.stderr
    turn, lift = load_machine("reach-arm.toml").joints
    assert turn.drive.kind == "current"
    assert (turn.drive.torque_constant.value, turn.drive.gear_ratio.value) == (0.05, 100.0)
    assert turn.drive.rotor_inertia is not None
    assert turn.drive.rotor_inertia.value == 1e-5
    assert turn.friction.viscous is not None
    assert turn.friction.viscous.value == 0.4
    assert turn.friction.coulomb is None
    assert lift.drive.kind == "gain"
    assert (lift.drive.gain.value, lift.drive.gain.unit) == (2.5, "N·m/V")
    assert lift.friction.viscous is not None
    assert lift.friction.viscous.source == "arm.urdf"
    assert "Assumed of lift: no Coulomb friction." in done.stderr
