"""Where settings come from, which goes before which, and what each of several robots has of its own."""

import math
import re
from pathlib import Path

import pytest

from daq.config.robot_files import load_memory_map
from daq.config.settings import Settings, config_files, load_settings, merged_limits
from daq.config.toml_text import settings_text
from daq.contracts.documents import parse_json, read_document
from daq.contracts.errors import SpecError
from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import load_machine
from firmware_protocol.memory_map import default_memory_map

MAP = Path(__file__).parents[3] / "firmware_protocol" / "memory_map.toml"


def test_the_guides_configuration_can_be_said_and_says_everything() -> None:
    guide = Path(__file__).parents[3].joinpath("docs", "user-guide.md").read_text("utf-8")
    (block,) = (
        text for text in re.findall(r"^```toml\n(.*?)^```", guide, re.MULTILINE | re.DOTALL) if "limits" in text
    )
    Path("daq.toml").write_text(block)
    settings, _ = load_settings()
    limits = settings.robot.limits
    assert limits is not None
    assert settings.model_fields_set == set(Settings.model_fields) - {"server", "notifications", "robots"}
    assert settings.robot.model_fields_set == set(type(settings.robot).model_fields)
    assert limits.model_fields_set == set(Limits.model_fields)
    assert settings.machine().limits.joints[0] == JointLimits(low=-1.0, high=1.0, speed=0.8)
    assert settings.machine().limits.joints[1] == load_machine("ma2000").limits.joints[1]


def test_with_nothing_configured_the_mock_is_used() -> None:
    settings, path = load_settings()
    assert path is None
    assert settings.port == "mock://"
    assert settings.machine() == load_machine("ma2000")


def test_the_file_asked_for_goes_before_the_folders_and_that_before_the_users(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    users = tmp_path / "configuration" / "ma2000-daq" / "config.toml"
    users.parent.mkdir(parents=True)
    for path, name in ((users, "users"), (tmp_path / "daq.toml", "here"), (tmp_path / "other.toml", "asked")):
        path.write_text(f'[robot]\nname = "{name}"\n')
    assert load_settings(Path("other.toml"))[0].robot.name == "asked"
    assert load_settings()[0].robot.name == "here"
    monkeypatch.setenv("DAQ_CONFIG", "other.toml")
    assert load_settings()[0].robot.name == "asked"
    monkeypatch.delenv("DAQ_CONFIG")
    Path("daq.toml").unlink()
    assert load_settings()[0].robot.name == "users"
    assert config_files() == [Path("daq.toml"), users]


def test_a_user_without_a_home_has_no_file_of_his_own(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless(_name: str) -> str:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr("daq.config.settings.platformdirs.user_config_dir", homeless)
    assert config_files() == [Path("daq.toml")]


def test_the_environment_goes_before_the_file_key_by_key(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("daq.toml").write_text('operator = "A"\n[robot]\nname = "here"\nport = "mock://?seed=1"\n')
    monkeypatch.setenv("DAQ_ROBOT__PORT", "mock://?seed=2")
    settings, _ = load_settings()
    assert (settings.robot.name, settings.port, settings.operator) == ("here", "mock://?seed=2", "A")
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", "somewhere")
    assert load_settings()[0] == settings
    monkeypatch.setenv("DAQ_SERVER__UNATTENDED", "true")
    assert load_settings()[0].server.unattended is True


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("DAQ_ROBOT__PROT", "3", "environment DAQ_ROBOT__PROT: robot.prot = '3': no such key"),
        ("DAQ_ROBOT__LIMITS__REACH", "nan", "environment DAQ_ROBOT__LIMITS__REACH: .* finite"),
        ("DAQ_ROBOT", "serial", "environment: .*DAQ_ROBOT__PORT|environment DAQ_ROBOT"),
    ],
)
def test_a_wrong_variable_is_named(monkeypatch: pytest.MonkeyPatch, name: str, value: str, words: str) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(SpecError, match=words) as caught:
        load_settings()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("nearly", ["1", '"yes"', '"on"', "1.0", '"True"', '"true"', '"false"'])
def test_whether_an_arm_may_move_unattended_is_true_or_false(nearly: str) -> None:
    Path("daq.toml").write_text(f"[server]\nunattended = {nearly}\n", "utf-8")
    with pytest.raises(SpecError, match=r"server\.unattended = .*: must be true or false"):
        load_settings()
    Path("daq.toml").write_text("[server]\nunattended = true\n", "utf-8")
    assert load_settings()[0].server.unattended is True


def test_a_file_that_is_named_must_be_there_and_be_one(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"missing\.toml: no such file"):
        load_settings(Path("missing.toml"))
    with pytest.raises(SpecError, match=r"memory map missing\.toml: cannot be read"):
        load_memory_map(Path("missing.toml"))
    assert load_memory_map(None).name.startswith("MA2000")
    texts = {"daq.toml": "[server]\nport = 8301\n", "map.toml": MAP.read_text("utf-8"), "a.json": "[1]"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8-sig")
    assert load_settings(tmp_path / "daq.toml")[0].server.port == 8301
    assert load_memory_map(tmp_path / "map.toml") == default_memory_map()
    assert read_document(tmp_path / "a.json", "a") == [1]
    assert parse_json("\ufeff[1]", "a") == [1]


def test_limits_replace_the_machines_one_by_one_and_may_not_contradict_it() -> None:
    machine = load_machine("ma2000")
    joints = tuple(JointLimits(speed=0.5) if joint == 1 else JointLimits() for joint in range(1, 7))
    merged = merged_limits(machine, Limits(reach=1.0, joints=joints))
    assert merged.reach == 1.0
    assert merged.following_error_counts == machine.limits.following_error_counts == 127
    assert merged.floor_height == machine.limits.floor_height
    assert merged.joint(1) == JointLimits(low=machine.limits.joint(1).low, high=machine.limits.joint(1).high, speed=0.5)
    assert merged.joint(2) == machine.limits.joint(2)
    machine = load_machine("ma2000")
    joints = (JointLimits(low=math.radians(350)), *(JointLimits() for _ in range(5)))
    with pytest.raises(SpecError, match=r"joint 1: low .* must be below high"):
        merged_limits(machine, Limits(joints=joints))


# ---- Several robots in one daq.toml

TWO = """
[robots.left]
port = "tcp://bench:4001"
unattended = true
limits = { reach = 0.4 }

[robots.right]
traces = "old"
[traces]
folder = "data"
"""


def test_each_robot_has_settings_as_if_it_were_the_only_one(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("daq.toml").write_text(TWO)
    settings = load_settings()[0]
    left, right = settings.each_robot()
    assert settings.names == ("left", "right")
    assert (left.robot.name, left.port, left.server.unattended) == ("left", "tcp://bench:4001", True)
    assert (right.robot.name, right.port, right.server.unattended) == ("right", "mock://", False)
    assert (left.traces.folder, right.traces.folder) == (Path("data/left"), Path("old"))
    assert left.machine().limits.reach == 0.4
    assert left.names == ("left",)
    Path("daq.toml").write_text('[robot]\nname = "arm"\n[server]\nunattended = true\n')
    settings = load_settings()[0]
    assert settings.of_robot() is settings
    assert settings.of_robot("arm") is settings
    assert "robots" not in settings_text(settings)
    Path("daq.toml").write_text(TWO)
    settings = load_settings()[0]
    again = Path("again.toml")
    again.write_text(settings_text(settings))
    assert load_settings(again)[0].each_robot() == settings.each_robot()
    Path("daq.toml").write_text(TWO)
    monkeypatch.setenv("DAQ_ROBOTS__RIGHT__PORT", "tcp://bench:4002")
    left, right = load_settings()[0].each_robot()
    assert (left.port, right.port) == ("tcp://bench:4001", "tcp://bench:4002")
    assert right.traces.folder == Path("old")


@pytest.mark.parametrize(
    ("name", "said"),
    [(None, "say which one with --robot: left, right"), ("middle", "robot 'middle': is not configured; there is left")],
)
def test_a_missing_or_unknown_name_is_answered_with_those_there_are(name: str | None, said: str) -> None:
    Path("daq.toml").write_text(TWO)
    with pytest.raises(SpecError, match=said):
        load_settings()[0].of_robot(name)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[robot]\nport = "mock://"\n[robots.left]\n', "robot and robots: give one of them"),
        ("[robots.left]\n[server]\nunattended = true\n", "server.unattended: with several robots each says so"),
        ('[robots.left]\nunattended = "true"\n', "robots.left.unattended = 'true': must be true or false, without"),
        ("[robots.Left]\n", r"robots.Left.* should match pattern"),
        ('[robots.left]\nname = "x"\n', "robots.left.name = 'x': no such key; allowed here: limits, machine"),
        (
            '[robots.left]\nport = "tcp://a:1?x=1"\n[robots.right]\nport = "tcp://a:1"\n',
            "robots left and right have the same port tcp://a:1",
        ),
        ('[robots.left]\ntraces = "a"\n[robots.right]\ntraces = "./a"\n', "have the same folder of traces"),
        ("".join(f"[robots.r{n}]\n" for n in range(33)), "at most 32"),
    ],
)
def test_a_configuration_that_mixes_robots_up_is_refused_in_one_line(text: str, said: str) -> None:
    Path("daq.toml").write_text(text)
    with pytest.raises(SpecError, match=said):
        load_settings()
