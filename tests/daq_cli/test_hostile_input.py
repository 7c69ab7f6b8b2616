"""Every option that takes a file or a number, given what nobody means: one line, and the exit code of wrong input."""

from pathlib import Path

import pytest

from daq.config.settings import load_settings
from daq_cli.commands.run import KINDS
from tests.daq_cli.hostile import FILES, NUMBERS, hostile_file, refuses
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.test_documentation import COMMANDS

READERS = {
    "--config {} config check": ".toml",
    "run spec {} --dry-run": ".json",
    "run spec {0} --dry-run --json": ".toml",
    "teach program {}": ".json",
    "teach program {0} --yes": ".toml",
    "teach play {} --dry-run": ".json",
    "restore {} --check": ".zip",
    "blind --folder trial --registration {}": ".toml",
}
NO_TOML = {"deep-objects", "long-number", "null", "no-numbers", "half-a-character"}
"""Kinds that a parser of TOML refuses at their first character, as it does "list"."""
NO_JSON = {"deep-toml", "long-key", "long-number-toml", "long-hexadecimal"}
"""The same for JSON and "binary"."""
LEFT_OUT = {".toml": NO_TOML, ".json": NO_JSON, ".zip": NO_TOML | NO_JSON | {"deep-json", "null", "latin1"}}
MAPS = ("machine", "memory_map")


@pytest.mark.parametrize(
    ("words", "kind"), [(words, kind) for words in READERS for kind in FILES if kind not in LEFT_OUT[READERS[words]]]
)
def test_a_hostile_file_is_refused_in_one_line(daq: CommandLine, words: str, kind: str) -> None:
    file = hostile_file(kind, READERS[words])
    if words.startswith("--config") and kind == "empty":
        return  # a configuration that says nothing
    if words.endswith("--dry-run --json") and kind == "empty":
        return  # the default experiment
    refuses(daq(*words.format(file).split()))


@pytest.mark.parametrize("kind", [kind for kind in FILES if kind not in NO_TOML])
@pytest.mark.parametrize("key", MAPS)
def test_a_hostile_file_named_in_the_configuration_is_refused(daq: CommandLine, key: str, kind: str) -> None:
    file = hostile_file(kind, ".toml")
    Path("daq.toml").write_text(f'[robot]\n{key} = "{file}"\n')
    refuses(daq("config", "check"))


def test_a_machine_file_that_is_binary_is_not_called_missing(daq: CommandLine) -> None:
    Path("machine.toml").write_bytes(b"\xff\xfe\x00")
    Path("daq.toml").write_text('[robot]\nmachine = "machine.toml"\n')
    daq("config", "check").complains(2, "machine file machine.toml", "not UTF-8 text (byte 0xff at 0)")


@pytest.mark.parametrize("digits", [60, 6000])
@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("run spec {} --dry-run", "trajectory.kind = 0x{}"),
        ("run spec {} --dry-run", "trajectory = {{ kind = 'ramp', amplitude = 0x{} }}"),
        ("--config {} config check", "operator = 0x{}"),
        ("--config {} config check", "server.port = 0x{}"),
        ("teach program {}", "format = 0x{}"),
    ],
)
def test_a_huge_hexadecimal_number_is_refused(daq: CommandLine, words: str, text: str, digits: int) -> None:
    Path("number.toml").write_text(text.format("f" * digits))
    refuses(daq(*words.format("number.toml").split()))


def options_of_motions() -> dict[str, list[str]]:
    """By kind of motion: every number that it has, the sine with those that all have in common."""
    common = ("settle", "hold", "repeats")
    found = {
        kind: [name.replace("_", "-") for name in model.model_fields if name not in ("kind", "back", "via", "phase")]
        for kind, model in KINDS.items()
    }
    found["sine"].extend(common)
    return {kind: options for kind, options in found.items() if options}


def numbers_of_motions() -> list[tuple[str, str, str]]:
    """(kind, option, value): every option once at least, and every value once at least for every kind."""
    found = []
    for offset, (kind, options) in enumerate(options_of_motions().items()):
        for number in range(max(len(options), len(NUMBERS))):
            value = NUMBERS[(number + offset) % len(NUMBERS)]
            allowed = [one for one in options if value != "-1" or one not in ("amplitude", "lift")]
            wanted = options[number % len(options)]
            if allowed:
                found.append((kind, wanted if wanted in allowed else allowed[number % len(allowed)], value))
    return found


@pytest.mark.parametrize(("kind", "option", "value"), numbers_of_motions())
def test_a_number_without_meaning_is_refused_in_one_line(daq: CommandLine, kind: str, option: str, value: str) -> None:
    refuses(daq("run", kind, f"--{option}={value}", "--dry-run"))


@pytest.mark.parametrize(
    "words",
    [
        "teach lead -o lead.json --seconds={}",
        "serve --port={}",
        "teach step --by 1={}",
        "teach jog --speed={}",
        "gains set 1={}/0/0",
        "io set {} on",
        "blind --folder t --seeds={}",
        "run ramp --joints={}",
        "run ramp --start=1=1,1={}",
        "run ramp --gains=1=2/{}/0",
    ],
)
@pytest.mark.parametrize("value", [value for value in NUMBERS if value])
def test_a_number_without_meaning_is_refused_before_anything_is_reached(
    daq: CommandLine, words: str, value: str
) -> None:
    refuses(daq("--port", "serial:///dev/nowhere", *words.format(value).split()))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("sine --period 0.03", ("sine: period", "0.03 s", "40 ms (two control periods) and more")),
        ("sine --period 3600 --cycles 1000", ("it would take 1e+03 h", "at most 4 h")),
        ("ramp --duration 0.019", ("ramp: duration", "20 ms (a control period)")),
        ("multisine --lowest 1e-300", ("lowest frequency of 1e-300 Hz", "0.001 Hz and more")),
        ("ramp --settle 0.001", ("settle: 0.001 s", "too short")),
        ("ramp --amplitude 0.1", ("amplitude", "half a set point (0.135°)", "0 to record the arm at rest")),
    ],
)
def test_a_motion_that_set_points_cannot_represent_is_refused(
    daq: CommandLine, words: str, expected: tuple[str, ...]
) -> None:
    daq("run", *words.split(), "--dry-run").complains(2, *expected)


@pytest.mark.parametrize("words", ["ramp --amplitude 0", "ramp --amplitude 1=10,2=0,3=0.1", "ramp --settle 0 --hold 0"])
def test_a_motion_of_zero_amplitude_is_allowed(daq: CommandLine, words: str) -> None:
    assert daq("run", *words.split(), "--dry-run").code == 0


def test_more_arms_than_a_trial_can_have_are_refused(daq: CommandLine) -> None:
    daq("blind", "--seeds", "1:1000000000000", "--folder", "t").complains(2, "1000000000000 arms", "at most 100000")
    assert not Path("t").exists()


@pytest.mark.parametrize(
    "text",
    [
        "",
        (
            'operator = "A \\"B\\" \\u007f é\\\\"\n[robot]\nname = "arm-2"\n[robot.limits]\nreach = 1e16\n'
            "joints = [{ low = -1.0, high = 1 }, {}, {}, {}, {}, { speed = 0.5 }]\n"
            '[traces]\nfolder = "a b/c"\n[server]\nport = 0\nunattended = true\nnames = ["a.lab", "b.lab"]\n'
        ),
    ],
    ids=["the defaults", "what is said"],
)
def test_the_configuration_shown_is_a_configuration(daq: CommandLine, text: str) -> None:
    Path("daq.toml").write_text(text)
    said = daq("config", "show")
    assert said.code == 0
    Path("again.toml").write_text(said.out)
    assert load_settings(Path("again.toml"))[0] == load_settings()[0]
    assert "# port is not set" in said.out.split("[robot]")[1].split("[")[0]


def test_the_configuration_is_checked_with_the_port_that_is_named(daq: CommandLine) -> None:
    daq("--port", "serial:///dev/x?baud=nan", "config", "check").complains(2, "baud 'nan'")
    assert "tcp://127.0.0.1:1" in daq("--port", "tcp://127.0.0.1:1", "config", "check").out


@pytest.mark.parametrize("name", ["\udcff.json", "a" * 300 + ".json", "new\nline.json", ".", "", "/", "/proc/self/mem"])
@pytest.mark.parametrize("words", ["--config {} config check", "run spec {} --dry-run", "teach program {}"])
def test_an_impossible_file_name_is_reported(daq: CommandLine, words: str, name: str) -> None:
    refuses(daq(*(word.format(name) for word in words.split(" "))))


@pytest.mark.parametrize("name", sorted(" ".join(words) for words in COMMANDS))
def test_a_wrong_option_is_reported_in_one_line(daq: CommandLine, name: str) -> None:
    if name != "mock":  # whose options are its own
        refuses(daq(*name.split(), "--no-such\noption"))
