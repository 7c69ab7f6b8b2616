"""Several robots in one daq.toml: each has settings of its own, and nothing that only one can have is shared."""

from pathlib import Path

import pytest

from daq.config.settings import load_settings
from daq.config.toml_text import settings_text
from daq.contracts.errors import SpecError

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


def test_each_robot_has_settings_as_if_it_were_the_only_one() -> None:
    Path("daq.toml").write_text(TWO)
    settings = load_settings()[0]
    left, right = settings.each_robot()
    assert settings.names == ("left", "right")
    assert (left.robot.name, left.port, left.server.unattended) == ("left", "tcp://bench:4001", True)
    assert (right.robot.name, right.port, right.server.unattended) == ("right", "mock://", False)
    assert (left.traces.folder, right.traces.folder) == (Path("data/left"), Path("old"))
    assert left.machine().limits.reach == 0.4
    assert left.names == ("left",)


def test_a_configuration_of_one_robot_is_as_it_was() -> None:
    Path("daq.toml").write_text('[robot]\nname = "arm"\n[server]\nunattended = true\n')
    settings = load_settings()[0]
    assert settings.of_robot() is settings
    assert settings.of_robot("arm") is settings
    assert "robots" not in settings_text(settings)


def test_what_is_shown_of_several_robots_loads_again() -> None:
    Path("daq.toml").write_text(TWO)
    settings = load_settings()[0]
    again = Path("again.toml")
    again.write_text(settings_text(settings))
    assert load_settings(again)[0].each_robot() == settings.each_robot()


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


def test_an_environment_variable_overrides_one_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("daq.toml").write_text(TWO)
    monkeypatch.setenv("DAQ_ROBOTS__RIGHT__PORT", "tcp://bench:4002")
    left, right = load_settings()[0].each_robot()
    assert (left.port, right.port) == ("tcp://bench:4001", "tcp://bench:4002")
    assert right.traces.folder == Path("old")
