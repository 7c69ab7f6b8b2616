"""What is printed: `--json` makes every result one document, and every table fits 80 columns with all its words."""

import json
import re
from pathlib import Path

import pytest
import typer

from daq.contracts.experiment import ExperimentSpec
from daq.trajectories.presets import PRESETS
from model.fitting.fitted import FittedParameter
from tests.daq.servo_bench import PAN_TILT
from tests.daq.traces.samples import write
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.test_documentation import COMMANDS

WITHOUT = {"serve", "mock", "demo", "docs", "mcp"} | {
    f"{group} {command}"
    for group, commands in {
        "gains": "set",
        "io": "set gripper",
        "queue": "pause resume approve withdraw unschedule",
        "token": "add revoke",
        "teach": "jog step program lead",
        "teach programs": "keep fetch delete",
        "machine": "tidy",
    }.items()
    for command in commands.split()
}
"""Commands that do something and have no data to give."""


def test_every_command_with_a_result_has_a_json_option() -> None:
    having = {" ".join(words) for words, one in COMMANDS.items() if any(p.name == "json" for p in one.params)}
    missing = {" ".join(words) for words in COMMANDS} - having
    assert missing <= WITHOUT


def test_every_option_has_a_help_text() -> None:
    silent = [
        (" ".join(words), parameter.name)
        for words, one in COMMANDS.items()
        for parameter in one.params
        if isinstance(parameter, typer.core.TyperOption | typer.core.TyperArgument) and not parameter.help
    ]
    assert silent == []


def test_a_local_status_with_another_machines_file_shows_no_angles(
    daq: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_ROBOT__MACHINE", str(PAN_TILT))
    daq("--port", port, "status").complains(4, "has 6 joints, the machine file pan_tilt describes 2")


def test_reset_presets_and_configuration_are_printed_as_json(daq: CommandLine, port: str) -> None:
    reset = json.loads(daq("--port", port, "reset", "--json").out)
    assert reset == {"server": None, "here": False, "text": "was not stopped"}
    listed = json.loads(daq("run", "preset", "--json").out)
    assert [one["name"] for one in listed] == list(PRESETS)
    checked = json.loads(daq("--port", "mock://", "config", "check", "--json").out)
    assert (checked["machine"], checked["joints"], checked["port"]) == ("ma2000", 6, "mock://")


def test_imported_exported_and_plotted_traces_are_printed_as_json(daq: CommandLine) -> None:
    Path("rig.csv").write_text(
        "time,set_point_1,position_1\n" + "".join(f"{k / 50},{k / 100},{k / 100}\n" for k in range(50))
    )
    made = json.loads(daq("traces", "import", "rig.csv", "--folder", "kept", "--json").out)
    assert Path(made["file"]).is_file()
    exported = json.loads(daq("traces", "export", made["file"], "-o", "again.csv", "--json").out)
    assert exported == {"trace": made["file"], "file": "again.csv"}
    drawn = json.loads(daq("traces", "plot", made["file"], "-o", "rig.html", "--json").out)
    assert Path(drawn["file"]).is_file()


# ---- tables of 80 columns


LONG = "joint2.direction_dependent_friction.coefficient_forwards"


def parameters() -> None:
    from daq_cli.models.parameter_table import print_parameters

    common = {"unit": "N·m·s²/rad²", "reason": "", "before": 0.000123456, "expected": 1.0, "expected_deviation": 0.1}
    known = {"verdict": "known", "value": 12.345678, "deviation": 1e-6, "low": 12.345670, "high": 12.345686}
    unknown = {"verdict": "combination", "value": None, "deviation": None, "low": None, "high": None}
    print_parameters(
        [
            FittedParameter(name=LONG, model_value=12.345678, at_bound="low", **known, **common),
            FittedParameter(name="link2.mass", model_value=0.846, at_bound=None, **unknown, **common),
        ]
    )


def test_a_table_of_results_fits(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    parameters()
    fits(capsys.readouterr().out)


@pytest.mark.parametrize("words", [("ls", "{}"), ("show", "{}/a.mcap")])
def test_a_table_of_traces_fits(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    write(tmp_path / "a.mcap", 50, spec=ExperimentSpec(name="a-ramp-of-the-shoulder-and-the-elbow", joints=(1, 3)))
    shown = daq("traces", *(word.format(tmp_path) for word in words))
    assert shown.code == 0
    fits("\n".join(line for line in shown.out.splitlines() if not line.startswith("file: ")))
    if words[0] == "ls":
        assert "1,3" in shown.out, "the joints that moved, not those that were recorded"


def fits(text: str) -> None:
    lines = text.splitlines()
    assert lines
    assert max(map(len, lines)) <= 80, text
    assert "…" not in text
    assert not re.findall(r"\d\.$", text, re.MULTILINE), "a number goes on in the next line"
    assert not re.findall(r"[\d±]\n\s*(?:kg|mm|m|rad|N·m|V|s)\b", text), "a number stands apart from its unit"
    assert not re.findall(r"/$", text, re.MULTILINE), "a unit goes on in the next line"


def test_a_folder_is_named_once(daq: CommandLine, tmp_path: Path) -> None:
    daq("traces", "ls", tmp_path, "--folder", tmp_path).complains(2, "named already")
    daq("traces", "ls", tmp_path / "none").complains(2, "is no folder")
