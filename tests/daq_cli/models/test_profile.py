"""`daq profile`: what a trace bounds on both sides, and what on one side alone."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from benchmarks.profile_likelihoods import MACHINE, TRUTH, rod_record
from daq.traces.store import write_trace
from tests.daq_cli.invoke import CommandLine

MASS, VISCOUS, ROTOR = TRUTH


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a hanging rod's machine file and a slow record of it."""
    folder = tmp_path_factory.mktemp("rod")
    (folder / "rod.toml").write_text(MACHINE, "utf-8")
    write_trace(rod_record(slow=True), folder / "rod.mcap")
    return folder


def test_an_interval_holds_the_true_value_and_is_written_as_json_csv_and_page(
    daq: CommandLine, rod: Path, tmp_path: Path
) -> None:
    table, page = tmp_path / "profile.csv", tmp_path / "profile.html"
    asked = ("--parameter", MASS, "--parameter", ROTOR, "--no-priors")
    said = daq("profile", rod / "rod.toml", rod / "rod.mcap", *asked, "-o", table, "--report", page, "--json")
    mass, rotor = json.loads(said.out)["profiles"]
    assert (mass["name"], rotor["name"]) == (MASS, ROTOR)
    assert mass["low"] < TRUTH[MASS] < mass["high"]
    assert rotor["high"] > TRUTH[ROTOR]
    with table.open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["parameter"] == MASS]
    assert [float(row["value"]) for row in rows] == pytest.approx(mass["values"], rel=1e-8)
    assert max(float(row["rise"]) for row in rows) > mass["rise"] * 0.99
    text = page.read_text("utf-8")
    assert "Profile likelihoods" in text
    assert MASS in text


def test_a_saved_fit_is_profiled_as_it_is_and_more_starts_fit_again(
    daq: CommandLine, rod: Path, tmp_path: Path
) -> None:
    fitted = tmp_path / "fitted.json"
    daq("fit", rod / "rod.mcap", "--machine", rod / "rod.toml", "--no-priors", "-o", fitted)
    once = json.loads(daq("profile", fitted, rod / "rod.mcap", "--parameter", MASS, "--json").out)
    again = json.loads(daq("profile", fitted, rod / "rod.mcap", "--parameter", MASS, "--starts", 2, "--json").out)
    (one,), (other,) = once["profiles"], again["profiles"]
    assert one["value"] == pytest.approx(other["value"], abs=0.1 * (one["high"] - one["low"]))
    assert not one["better"]


def test_the_table_says_that_the_scale_of_torque_is_not_bounded(daq: CommandLine, rod: Path) -> None:
    """With the drive's gain free, mass, friction and gain may all be larger by one factor."""
    free = ("--parameters", "*.mass,*.gain,*.coefficient,*.inertia", "--no-priors")
    said = daq("profile", rod / "rod.toml", rod / "rod.mcap", "--parameter", MASS, *free)
    (line,) = [line for line in said.out.splitlines() if line.split()[:1] == [MASS]]
    assert line.split()[3] == "–"
    assert "do not bound it on this side" in said.out


def test_a_parameter_that_is_not_fitted_is_one_line_before_anything_is_computed(daq: CommandLine, rod: Path) -> None:
    said = daq("profile", rod / "rod.toml", rod / "rod.mcap", "--parameter", "link1.length")
    said.complains(2, "--parameter link1.length: is not fitted; fitted are")
