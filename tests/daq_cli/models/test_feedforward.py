"""`daq run … --feedforward` and `--learn-from`: what is run, what the trace tells of it, and wrong input."""

import json
from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from daq.traces.reader import read_trace
from model.machine_model.model import base_model
from model.machine_model.model_file import save_model
from tests.daq_cli.invoke import CommandLine

EXAMPLE = Path(__file__).parents[3] / "examples" / "single_axis.toml"
SHORT = ("--settle", "0.2", "--hold", "0.3", "--folder", "traces")


@pytest.fixture
def model() -> Path:
    """A model file of the arm as its machine file has it."""
    return save_model(base_model(load_machine("ma2000")), Path("model.json"))


def test_a_motion_is_followed_and_its_trace_tells_expected_beside_reached(
    daq: CommandLine, port: str, model: Path
) -> None:
    ran = daq("--port", port, "run", "ramp", "--feedforward", model, *SHORT)
    assert ran.code == 0, ran.err
    assert "to follow the ramp" in ran.err
    assert "plain set points" in ran.err
    shown = daq("traces", "show", "last", "--folder", "traces")
    assert "computed with model" in shown.out
    assert "reached" in shown.out
    data = json.loads(daq("traces", "show", "last", "--folder", "traces", "--json").out)
    assert [row["joint"] for row in data["tracking"]] == [1, 2, 3]
    for row in data["tracking"]:
        assert row["unit"] == "°"
        assert row["reached"]["rms"] < row["before"]["rms"] / 2
        assert row["expected"]["rms"] / 3 < row["reached"]["rms"] < 3 * row["expected"]["rms"]


def test_set_points_are_learned_from_a_trace(daq: CommandLine, port: str) -> None:
    run = ("--port", port, "run", "ramp", *SHORT, "--json")
    first = json.loads(daq(*run).out)
    again = daq(*run, "--learn-from", "last", "--learn-share", "0.5")
    assert again.code == 0, again.err
    assert "in that trace" in again.err
    spec = read_trace(Path(json.loads(again.out)["trace"])).record.spec
    assert spec is not None
    assert spec.feedforward is not None
    assert spec.feedforward.learned_from == read_trace(Path(first["trace"])).record.trace_id
    assert spec.feedforward.model is None


def test_a_plain_trace_has_no_tracking_error_to_tell(daq: CommandLine, port: str) -> None:
    assert daq("--port", port, "run", "step", "--joints", "3", *SHORT).code == 0
    shown = daq("traces", "show", "last", "--folder", "traces", "--json")
    assert json.loads(shown.out)["tracking"] is None
    assert "tracking" not in daq("traces", "show", "last", "--folder", "traces").out


def test_a_dry_run_gives_the_experiment_for_a_queue(daq: CommandLine, model: Path) -> None:
    data = json.loads(daq("run", "preset", "ramp", "--feedforward", model, "--dry-run", "--json").out)
    assert data["violations"] == []
    Path("computed.json").write_text(json.dumps(data["experiment"]))
    assert "path: 3.1" in daq("run", "spec", "computed.json", "--dry-run").out
    daq("run", "spec", "computed.json", "--feedforward", model, "--dry-run").complains(2, "computed already")


def test_wrong_input_is_refused_in_one_line(daq: CommandLine, port: str, model: Path) -> None:
    run = ("--port", port, "run", "ramp", *SHORT)
    other = save_model(base_model(load_machine(str(EXAMPLE))), Path("other.json"))
    daq(*run, "--feedforward", "none.json").complains(2, "model none.json")
    daq(*run, "--feedforward", other).complains(2, "the experiment is for ma2000")
    daq(*run, "--learn-from", "last").complains(2, "traces")
    daq(*run, "--feedforward", model, "--amplitude", "200").complains(4, "joint")
    assert daq("--port", port, "run", "step", "--joints", "3", *SHORT).code == 0
    daq(*run, "--learn-from", "last").complains(2, "of another motion: its trajectory differs")
    assert daq(*run, "--learn-from", "last", "--learn-share", "1.5").code == 2
    daq(*run, "--learn-share", "0.5").complains(2, "--learn-share: is for --learn-from")
