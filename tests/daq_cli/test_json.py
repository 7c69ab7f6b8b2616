"""`--json` makes every result one JSON document, the same here and at a server."""

import json
from pathlib import Path

import pytest
import typer

from daq.contracts.service.robot import RobotStatus
from daq.contracts.status import StatusReport, report_of
from daq.trajectories.presets import PRESETS
from tests.daq.servo_bench import PAN_TILT
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.test_documentation import COMMANDS

WITHOUT = {"serve", "mock", "demo", "docs"} | {
    f"{group} {command}"
    for group, commands in {
        "gains": "set",
        "io": "set gripper",
        "queue": "pause resume approve withdraw unschedule",
        "token": "add revoke sign-out",
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


def test_a_local_status_has_the_fields_of_a_service(daq: CommandLine, port: str) -> None:
    said = daq("--port", port, "status", "--json")
    assert said.code == 0, said.err
    found = StatusReport.model_validate_json(said.out)
    assert (found.server, found.queue, found.control) == (None, None, None)
    assert found.sample is not None
    assert found.identity is not None
    assert (found.connection, found.arm, found.sample.joints) == ("connected", "idle", (1, 2, 3, 4, 5, 6))
    assert "missed_set_points" in found.link.counters


def test_a_local_status_with_another_machines_file_shows_no_angles(
    daq: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_ROBOT__MACHINE", str(PAN_TILT))
    daq("--port", port, "status").complains(4, "has 6 joints, the machine file pan_tilt describes 2")


def test_a_status_report_has_every_field_of_a_services_status() -> None:
    """So that `report_of` leaves nothing out."""
    own = StatusReport.model_fields
    assert set(own) - {"server"} == set(RobotStatus.model_fields)
    for name, field in RobotStatus.model_fields.items():
        wanted = field.annotation if name not in ("control", "queue") else field.annotation | None
        assert own[name].annotation == wanted, name


def test_a_services_status_is_reported_completely() -> None:
    moment = "2026-01-01T00:00:00Z"
    data = {
        "robot": "ma2000",
        "machine": "ma2000",
        "port": "mock://",
        "connection": "lost",
        "arm": "disconnected",
        "activity": "none",
        "link": {"state": "none"},
        "control": {"holder": "nobody"},
        "utc": moment,
        "queue": {"paused": True, "reason": "no arm", "since": moment, "queued": 2},
    }
    status = RobotStatus.model_validate(data)
    told = report_of(status, "http://arm:8300").model_dump(mode="json")
    assert told == {"server": "http://arm:8300", **status.model_dump(mode="json")}


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


@pytest.mark.parametrize("words", ["run preset nonsense --json", "traces show nothing --json"])
def test_a_failing_command_prints_no_json(daq: CommandLine, words: str) -> None:
    daq(*words.split()).complains(2)
