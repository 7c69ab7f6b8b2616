"""A URDF that nobody means is refused in one line that says what is wrong and where."""

import math
import re
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from extras.formats.robot_files.urdf_reader import read_urdf
from extras.formats.robot_files.urdf_text import checked_urdf
from model.machine_model.model import base_model
from tests.daq.traces.file_fuzz import Kind, campaign
from tests.extras.formats.robot_files.arms import ARMS
from tests.extras.formats.robot_files.robots import HOSTILE, INERTIAL, TURNING, TWO_JOINTS, joint, link, robot

EXAMPLES = Path(__file__).parents[4] / "examples"


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.urdf"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_urdf_is_refused_in_one_line(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text, said = HOSTILE[name]
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SpecError) as refused:
        base_model(machine_from_urdf(written(tmp_path, text)))
    line = str(refused.value)
    assert said in line
    assert len(line) < 1000
    assert line.isprintable()
    assert capfd.readouterr() == ("", "")
    assert [path.name for path in tmp_path.iterdir()] == ["robot.urdf"]


@pytest.mark.parametrize(
    ("names", "hold", "tip", "said"),
    [
        (["elbow", "wrist"], {}, None, "has no joint 'wrist' that moves; it has shoulder, elbow"),
        (["elbow", "elbow"], {}, None, "--joints elbow,elbow: name each joint once"),
        ([], {}, None, "name each joint once"),
        (["elbow"], {"elbow": 1.0}, None, "--hold elbow=1.0: it is one of the joints that move"),
        (["elbow"], {"wrist": 1.0}, None, "--hold wrist=1.0: there is no such joint"),
        (["elbow"], {"shoulder": float("nan")}, None, "--hold shoulder=nan: a finite position is needed"),
        (["shoulder"], {}, "base", "--tip base: the last joint carries no such link; it carries upper, lower"),
    ],
)
def test_joints_that_make_no_arm_are_refused_in_one_line(
    tmp_path: Path, names: list[str], hold: dict[str, float], tip: str | None, said: str
) -> None:
    with pytest.raises(SpecError) as refused:
        machine_from_urdf(written(tmp_path, TWO_JOINTS), names, hold=hold, tip=tip)
    assert said in str(refused.value)


def test_a_joint_that_mimics_one_that_moves_is_refused_even_if_it_is_held(tmp_path: Path) -> None:
    follower = joint("finger", "b", "c", content=f'{TURNING}<mimic joint="wrist" multiplier="2" offset="0.5"/>')
    file = written(tmp_path, robot(*map(link, "abcd"), joint("wrist", "a", "b"), follower, joint("last", "b", "d")))
    with pytest.raises(SpecError, match=r"joint 'finger' mimics 'wrist', which moves: .* hold it \(--hold finger=0\)"):
        machine_from_urdf(file, ["wrist"])
    assert "Held: finger at 0.3" in machine_from_urdf(file, ["wrist"], hold={"finger": 0.3, "last": 0.0}).notes
    with pytest.raises(SpecError, match="joint 'finger' mimics 'wrist'; a model's joints are independent"):
        machine_from_urdf(file, ["wrist", "finger"])
    held = machine_from_urdf(file, ["last"], hold={"wrist": 0.25}).notes
    assert "Held: wrist at 0.25, finger at 1." in held


def test_missing_limits_are_none_and_said_to_be_missing(tmp_path: Path) -> None:
    text = robot(link("a"), link("b"), joint("turn", "a", "b", content='<axis xyz="0 0 1"/>'))
    machine = machine_from_urdf(written(tmp_path, text))
    limits = machine.limits.joint(1)
    assert (limits.low, limits.high, limits.speed) == (None, None, None)
    assert "The URDF states no range of turn." in machine.notes


def test_moments_that_no_real_body_has_are_told(tmp_path: Path) -> None:
    unreal = INERTIAL.replace('"0.03"', '"0.3"')
    machine = machine_from_urdf(written(tmp_path, robot(link("a"), link("b", unreal), joint("j", "a", "b"))))
    assert "No real body has the moments that joint j carries (0.019" in machine.notes


@pytest.mark.parametrize(
    ("pattern", "factor", "said"),
    [
        (r'(xyz=")([^"]*)"', 1000.0, "are lengths in mm?"),
        (r'(mass value=")([^"]*)"', 1000.0, "are they in g, mm or placeholders?"),
        (r'(rpy=")([^"]*)"', math.degrees(1), "are angles in degrees?"),
        (r'(lower="|upper=")([^"]*)"', math.degrees(1), "are limits in degrees?"),
    ],
)
def test_a_urdf_in_other_units_is_doubted(pattern: str, factor: float, said: str) -> None:
    def scaled(match: re.Match[str]) -> str:
        return match[1] + " ".join(repr(float(word) * factor) for word in match[2].split()) + '"'

    text = ARMS["ur5"].path.read_text()
    assert checked_urdf(text, "ur5").doubts == ()
    (doubt,) = checked_urdf(re.sub(pattern, scaled, text), "ur5").doubts
    assert said in doubt


def test_a_doubt_is_in_the_notes_of_the_machine(tmp_path: Path) -> None:
    heavy = TWO_JOINTS.replace('mass value="2"', 'mass value="2000"')
    assert "CHECK: link 'base' has 2000 kg with moments" in machine_from_urdf(written(tmp_path, heavy)).notes
    far = TWO_JOINTS.replace('xyz="0.1 0.2 0.3"', 'xyz="100 200 300"')
    with pytest.raises(SpecError, match=r"more than 100 m away.*; its joints are 748.3 m apart in all.*lengths in mm"):
        machine_from_urdf(written(tmp_path, far))


def test_what_is_not_taken_over_of_limits_and_gears_is_noted(tmp_path: Path) -> None:
    inside = '<safety_controller soft_lower_limit="-0.1" soft_upper_limit="0.1" k_velocity="1"/></joint>'
    geared = "<transmission><joint/><mechanicalReduction>50</mechanicalReduction></transmission></robot>"
    text = TWO_JOINTS.replace("</joint>", inside, 1).replace("</robot>", geared)
    notes = machine_from_urdf(written(tmp_path, text)).notes
    assert "the soft limits of its safety_controller are narrower" in notes
    assert "mechanicalReduction of its transmissions is not imported" in notes
    assert "safety_controller" not in machine_from_urdf(written(tmp_path, TWO_JOINTS)).notes


@pytest.mark.parametrize("declared", ['xmlns:xacro="http://www.ros.org/wiki/xacro"', ""])
def test_xacro_that_was_not_expanded_is_named(tmp_path: Path, declared: str) -> None:
    with pytest.raises(SpecError, match=r"is xacro that was not expanded; .*`xacro FILE > robot\.urdf`"):
        machine_from_urdf(written(tmp_path, f'<robot name="a" {declared}><xacro:arm name="b"/></robot>'))


@pytest.mark.parametrize("number", ["damping", "friction"])
def test_a_joint_that_drives_itself_is_refused(tmp_path: Path, number: str) -> None:
    text = re.sub(r'(<joint name="shoulder"[^>]*>)', rf'\1<dynamics {number}="-0.8"/>', TWO_JOINTS, count=1)
    assert text != TWO_JOINTS
    with pytest.raises(SpecError, match=rf"joint 'shoulder': {number} is -0\.8; 0 or a positive number is needed"):
        machine_from_urdf(written(tmp_path, text))


def test_a_default_namespace_changes_nothing(tmp_path: Path) -> None:
    plain = machine_from_urdf(written(tmp_path, TWO_JOINTS))
    spaced = TWO_JOINTS.replace("<robot ", '<robot xmlns="http://example.org/urdf" ', 1)
    assert spaced != TWO_JOINTS
    assert machine_from_urdf(written(tmp_path, spaced)) == plain


def test_a_urdf_is_read_in_the_encoding_that_it_declares(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    body = TWO_JOINTS.removeprefix('<?xml version="1.0"?>') + "<!-- Körper -->"
    path.write_bytes(('<?xml version="1.0" encoding="ISO-8859-1"?>\n' + body).encode("latin-1"))
    assert len(machine_from_urdf(path).joints) == 2
    for head, said in (
        ("", "it is not UTF-8 text"),
        ('<?xml version="1.0" encoding="klingon"?>', "'klingon', which is"),
        ('<?xml version="1.0" encoding="cp037"?>', "its first line is not in encoding 'cp037'"),
        ('<?xml version="1.0" encoding="punycode"?>', "it is not punycode text"),
    ):
        path.write_bytes((head + body).encode("latin-1"))
        with pytest.raises(SpecError, match=said):
            machine_from_urdf(path)


def test_damaged_files_are_refused_in_one_line_or_read_as_a_whole(tmp_path: Path) -> None:
    data, path = (EXAMPLES / "reach_arm.urdf").read_bytes(), tmp_path / "arm.urdf"
    path.write_bytes(data)
    tally = campaign(300, 2, [Kind("URDF", path, path, read_urdf, data)])
    assert not tally.faults, "\n".join(tally.examples)
    assert tally.ends["read"] > 15
