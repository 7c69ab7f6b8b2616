"""`daq follow`: what is run, what the trace tells of it, wrong input, and the page's program."""

import json
import re
from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from daq.traces.reader import read_trace
from model.machine_model.model import base_model
from model.machine_model.model_file import save_model
from tests.daq_cli.invoke import CommandLine

EXAMPLE = Path(__file__).parents[3] / "examples" / "single_axis.toml"
PAGE = (EXAMPLE.parents[1] / "docs" / "feedforward.md").read_text("utf-8")
FOLDER = ("--folder", "traces")
SHORT = ("--settle", "0.2", "--hold", "0.3", *FOLDER)


@pytest.fixture
def model() -> Path:
    """A model file of the arm as its machine file has it."""
    return save_model(base_model(load_machine("ma2000")), Path("model.json"))


def test_a_motion_is_followed_and_its_trace_tells_expected_beside_reached(
    daq: CommandLine, port: str, model: Path
) -> None:
    Path("ramp.json").write_text(json.dumps({"trajectory": {"kind": "ramp"}, "settle": 0.2, "hold": 0.3}))
    ran = daq("--port", port, "follow", "run", "ramp.json", "--model", model, *FOLDER)
    assert ran.code == 0, ran.err
    assert "to follow the ramp" in ran.err
    assert "plain set points" in ran.err
    shown = daq("follow", "show", *FOLDER)
    assert "computed with model" in shown.out
    assert "reached" in shown.out
    data = json.loads(daq("follow", "show", "--json", *FOLDER).out)
    assert [row["joint"] for row in data["tracking"]] == [1, 2, 3]
    for row in data["tracking"]:
        assert row["unit"] == "°"
        assert row["reached"]["rms"] < row["before"]["rms"] / 2
        assert row["expected"]["rms"] / 3 < row["reached"]["rms"] < 3 * row["expected"]["rms"]


def test_set_points_are_learned_from_a_trace_and_its_motion_can_be_followed(
    daq: CommandLine, port: str, model: Path
) -> None:
    first = json.loads(daq("--port", port, "run", "ramp", *SHORT, "--json").out)
    assert "reached" in daq("follow", "show", *FOLDER).out
    again = daq("--port", port, "follow", "learn", "--share", "0.5", "--json", *FOLDER)
    assert again.code == 0, again.err
    assert "in that trace" in again.err
    spec = read_trace(Path(json.loads(again.out)["trace"])).record.spec
    assert spec is not None
    assert spec.feedforward is not None
    assert spec.feedforward.learned_from == read_trace(Path(first["trace"])).record.trace_id
    assert spec.feedforward.model is None
    planned = daq("follow", "run", "last", "-m", model, "--dry-run", "--json", *FOLDER)
    assert json.loads(planned.out)["experiment"]["feedforward"]["asked"]["settle"] == 0.2


def test_a_dry_run_gives_the_experiment_for_a_queue(daq: CommandLine, model: Path) -> None:
    data = json.loads(daq("follow", "run", "ramp", "-m", model, "--dry-run", "--json").out)
    assert data["violations"] == []
    Path("computed.json").write_text(json.dumps(data["experiment"]))
    assert "path: 3.1" in daq("run", "spec", "computed.json", "--dry-run").out


def test_wrong_input_is_refused_in_one_line(daq: CommandLine, port: str, model: Path) -> None:
    follow = ("--port", port, "follow")
    other = save_model(base_model(load_machine(str(EXAMPLE))), Path("other.json"))
    daq(*follow, "run", "ramp", "-m", "none.json").complains(2, "model none.json")
    daq(*follow, "run", "ramp", "-m", other).complains(2, "the experiment is for ma2000")
    daq(*follow, "run", "none.json", "-m", model).complains(2, "experiment none.json")
    daq(*follow, "run", "nothing", "-m", model, *FOLDER).complains(2, "traces")
    daq(*follow, "learn", *FOLDER).complains(2, "traces")
    Path("far.json").write_text(json.dumps({"trajectory": {"kind": "ramp", "amplitude": 3.5}}))
    daq(*follow, "run", "far.json", "-m", model).complains(4, "joint")
    assert daq(*follow, "learn", "--share", "1.5").code == 2


@pytest.mark.slow
def test_the_page_s_program_runs(daq: CommandLine, port: str) -> None:
    first = json.loads(daq("--port", port, "run", "ramp", *SHORT, "--json").out)
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    given = {"model": base_model(load_machine("ma2000")), "first": read_trace(Path(first["trace"]))}
    exec(compile(program, "feedforward.md", "exec"), given)
