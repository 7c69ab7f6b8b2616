"""What cannot be is refused in one line that says what, where and what is allowed; nothing moves, nothing is lost."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from daq.transport.mock_process import MockProcess
from tests.daq_cli.board import held, silent_port
from tests.daq_cli.invoke import CommandLine


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("run ramp --joints 7", ("no joint 7", "joints are 1 to 6")),
        ("run ramp --joints 3-1", ("3-1 runs backwards", "write 1-3")),
        ("run ramp --joints two", ("joints 'two'", "write 1-3, 1,3 or 2")),
        ("run ramp --amplitude 400", ("trajectory.amplitude", "between -360° and 360°", "400°")),
        ("run ramp --amplitude 1=10,2=10", ("amplitude is given for joints [1, 2]", "[1, 2, 3]")),
        ("run ramp --duration 0", ("duration", "greater than 0")),
        ("run ramp --daily 25:00", ("--daily '25:00'", "is no time of a day; write 00:00 to 23:59")),
        ("run ramp --daily 02:00 --cron *", ("--daily and --cron: give one of them",)),
        ("run ramp --gains 1=21/0/0", ("gains", "less than or equal to 20")),
        ("run ramp --gains 1=2/0", ("gains of joint 1", "write P/I/D")),
        ("run ramp --start 180", ("start '180'", "joint=angle")),
        ("run ramp --record 1", ("record [1]", "leaves out")),
        ("run ramp --speed 3", ("--speed", "`daq run ramp --help`")),
        ("run ramp --duration soon", ("--duration", "number")),
        ("run nonsense", ("nonsense", "`daq run --help`")),
        ("nonsense", ("nonsense", "`daq --help`")),
        ("fit x.mcap --method maybe", ("'--method': 'maybe' is not one of 'least_squares', 'nelder_mead' (see",)),
        ("run spec missing.json", ("experiment missing.json", "cannot be read")),
        ("--config missing.toml run ramp", ("missing.toml", "no such file")),
    ],
)
def test_wrong_options_are_refused_in_one_line(daq: CommandLine, words: str, expected: tuple[str, ...]) -> None:
    daq(*words.split()).complains(2, *expected)


def test_a_port_that_is_no_url_is_refused(daq: CommandLine) -> None:
    daq("--port", "/dev/ttyUSB0", "run", "ramp").complains(2, "must begin with serial://", "serial:///dev/ttyUSB0")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--amplitude 200", ("joint", "allowed are")),
        ("--amplitude 40 --duration 0.2", ("°/s", "allowed are up to")),
        ("--joints 2 --amplitude=-200", ("joint 2", "allowed are")),
    ],
    ids=["range", "speed", "below"],
)
def test_a_dry_run_names_the_violated_limits(daq: CommandLine, words: str, expected: tuple[str, ...]) -> None:
    said = daq("run", "ramp", "--dry-run", *words.split())
    assert said.code == 4
    assert said.err.count("\n") == 1
    assert all(word in said.err for word in expected)


def test_a_motion_outside_the_limits_moves_nothing(daq: CommandLine, mock: MockProcess, port: str) -> None:
    before = held(mock)
    daq("--port", port, "run", "ramp", "--amplitude", "200", "--gains", "1=9/9/9", "--folder", "t").complains(
        4, "refused", "allowed are", "nothing moved"
    )
    assert held(mock) == before
    assert not Path("t").exists()


def test_a_folder_that_cannot_be_written_to_moves_nothing(daq: CommandLine, mock: MockProcess, port: str) -> None:
    Path("file").write_text("")
    before = held(mock)
    daq("--port", port, "run", "ramp", "--folder", "file/traces").complains(2, "file/traces", "cannot be written")
    assert held(mock) == before


@contextmanager
def refused_connection() -> Iterator[str]:
    """The address of a port at which nothing listens."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        yield f"127.0.0.1:{free.getsockname()[1]}"


def test_a_port_that_cannot_be_opened_is_reported(daq: CommandLine) -> None:
    daq("--port", "serial:///dev/nowhere", "run", "ramp").complains(3, "/dev/nowhere does not exist", "daq ports")
    with refused_connection() as address:
        daq("--port", f"tcp://{address}", "run", "ramp").complains(3, f"nothing listens at {address}")
    with silent_port() as name, serial.Serial(name, exclusive=True):
        daq("--port", f"serial://{name}", "run", "ramp").complains(3, name, "in use by another program")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[robot]\nprot = 3\n", ("robot.prot = 3", "allowed here: limits, machine, memory_map, name, owners, port")),
        ('[robot]\nname = "My Arm"\n', ("robot.name = 'My Arm'", "should match pattern")),
        ("[robot.limits]\nreach = -1\n", ("robot.limits.reach = -1", "greater than 0")),
        ("[robot.limits]\njoints = [{}]\n", ("robot.limits.joints has 1 entries", "6 joints")),
        ("[robot]\nmachine = 'none.toml'\n", ("none",)),
        ("robot\n", ("daq.toml", "not TOML")),
        ("[robot]\nport = '/dev/x'\n", ("'/dev/x'", "must begin with serial://")),
    ],
)
def test_a_wrong_configuration_names_key_value_and_what_is_allowed(
    daq: CommandLine, text: str, expected: tuple[str, ...]
) -> None:
    Path("daq.toml").write_text(text)
    said = daq("config", "check")
    assert said.code in (2, 3)
    assert said.err.count("\n") == 1
    assert all(word in said.err for word in expected), said.err
