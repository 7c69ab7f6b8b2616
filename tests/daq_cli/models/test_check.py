"""`daq check`, and what every command of models does with a record that it doubts."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import SINGLE_AXIS, write_csv
from tests.daq_cli.models.test_fit_torques import WORDS, write_swing

SPIKES = (300, 500, 900)
COMMANDS = {
    "fit": ("fit", "{}", "--machine", SINGLE_AXIS, "-o", "out.json"),
    "torques": ("fit", "{}", *WORDS),
    "validate": ("validate", SINGLE_AXIS, "{}"),
    "profile": ("profile", SINGLE_AXIS, "{}", "--parameter", "link1.mass"),
    "compare": ("compare", SINGLE_AXIS, SINGLE_AXIS, "{}"),
    "simulate": ("simulate", SINGLE_AXIS, "{}"),
    "diagnose": ("diagnose", "{}", "--model", SINGLE_AXIS, "-o", "out.json"),
}


def changed(path: Path, *, spikes: bool = False, slower: float = 1.0) -> Path:
    """The swing with three false readings, or times so many times as long."""
    write_swing(path, 1)
    head, rows = path.read_text("utf-8").splitlines()[0], np.loadtxt(path, delimiter=",", skiprows=1)
    rows[:, 0] *= slower
    rows[list(SPIKES) if spikes else [], 2] += 0.7
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


def test_a_record_is_checked_and_its_faults_have_their_place(daq: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    write_swing(Path("sound.csv"), 1)
    assert daq("check", "sound.csv", "--model", SINGLE_AXIS).code == 0
    changed(Path("spiked.csv"), spikes=True)
    said = daq("check", "spiked.csv", "--model", SINGLE_AXIS)
    assert said.code == 2
    assert "CHECK spiked.csv: joint 1: 3 spikes at 1.50, 2.50, 4.50 s, of " in " ".join(said.out.split())
    assert max(map(len, said.out.splitlines())) <= 80
    said = daq("check", "spiked.csv", "--model", SINGLE_AXIS, "--json")
    told = json.loads(said.out)
    (found,) = [one for one in told["findings"] if one["consequence"] == "doubt"]
    assert [one["field"] for one in told["fields"]] == ["time", "position", "velocity", "set point", "drive"]
    assert (said.code, found["kind"], found["joint"], found["count"]) == (2, "spikes", 1, 3)
    assert found["times"] == pytest.approx([0.005 * row for row in SPIKES])


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_nothing_is_computed_of_a_doubted_record(daq: CommandLine, words: tuple[object, ...]) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq(*(str(word).format("spiked.csv") for word in words))
    assert said.code == 2, said.err
    assert said.out.count("3 spikes") == 1, said.out
    assert "CHECK" in said.out
    assert not Path("out.json").exists()


def test_times_in_ms_are_said_before_anything_else_fails(daq: CommandLine) -> None:
    changed(Path("slow.csv"), slower=1000.0)
    said = daq("fit", "slow.csv", *WORDS)
    assert said.code == 2
    assert "CHECK" in said.out
    assert "cutoff" not in said.err


@pytest.mark.timeout(300)
def test_despite_doubts_a_model_is_computed_and_the_exit_code_says_so(daq: CommandLine) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq("fit", "spiked.csv", *WORDS, "--despite-doubts")
    assert said.code == 2
    assert Path("out.json").exists()
    assert "Check the record first: spiked.csv: joint 1: 3 spikes" in " ".join(said.out.split())


def test_a_trace_of_more_joints_than_the_machine_asks_for_its_own(daq: CommandLine) -> None:
    write_csv(Path("seven.csv"), joints=7)
    daq("check", "seven.csv").complains(2, "has a joint 7, and ma2000 has 6 joints; name its machine or model")
    daq("check", "seven.csv", "--model", SINGLE_AXIS).complains(2, "has a joint 7", "has 1 joint; is it of another")


def test_an_import_says_what_was_read_what_is_doubted_and_what_comes_next(daq: CommandLine) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq("traces", "import", "spiked.csv")
    assert said.code == 0, said.err
    assert "1200 samples of joint 1 over 6.00 s: position, set point, drive" in " ".join(said.err.split())
    assert f"next: daq check {said.out.strip()} --model MACHINE.toml" in said.err
    Path("spiked.toml").write_text(f'machine = "{SINGLE_AXIS}"\n', "utf-8")
    said = daq("traces", "import", "spiked.csv")
    assert "CHECK" in said.err
    assert "3 spikes" in said.err
