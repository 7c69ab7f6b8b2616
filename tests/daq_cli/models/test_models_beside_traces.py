"""Simulate, compare, fit and profile from the command line, on traces whose truth is known."""

import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import ROOT, SINGLE_AXIS, write_csv, write_swing

RIG = ROOT / "examples" / "single_axis_rig.py"


def rig_traces(folder: Path) -> list[Path]:
    """Traces of the pretended rig of the guide."""
    run = subprocess.run([sys.executable, str(RIG), str(folder)], check=True, capture_output=True, text=True)
    return [Path(line) for line in run.stdout.split()]


def test_a_simulated_trace_is_reproduced_without_residual(daq: CommandLine, tmp_path: Path) -> None:
    """What `simulate` writes is a trace like any other; the model explains its own motion to one count, since the
    start posture is known no better."""
    trace = write_csv(tmp_path / "sine.csv")
    first = daq("simulate", SINGLE_AXIS, trace, "-o", tmp_path / "simulated.csv", "--json")
    assert json.loads(first.out)["agreement"]["in_sample"][0]["rmse"] > 0
    again = json.loads(daq("simulate", SINGLE_AXIS, tmp_path / "simulated.csv", "--json").out)
    assert again["agreement"]["in_sample"][0]["largest"] < 1.01 * 2 * math.pi / 2**14


def test_a_simulated_trace_does_not_replace_the_machine_file(daq: CommandLine, tmp_path: Path) -> None:
    machine = tmp_path / "axis.toml"
    machine.write_text(SINGLE_AXIS.read_text())
    said = daq("simulate", machine, write_csv(tmp_path / "run.csv"), "-o", tmp_path / "axis.csv")
    said.complains(2, "axis.csv", "axis.toml")
    assert machine.read_text() == SINGLE_AXIS.read_text()


def test_a_fitted_model_is_kept_when_the_comparison_fails(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Found:
        model = base_model(load_machine(str(SINGLE_AXIS)))

        def save(self, path: Path) -> None:
            path.write_text("found")

    def fails(*_: object, **__: object) -> None:
        raise SpecError("cannot be compared")

    monkeypatch.setattr("model.fitting.fit.fit", lambda *_: Found())
    monkeypatch.setattr("model.comparison.compare.compare", fails)
    out = tmp_path / "out.json"
    said = daq("fit", write_csv(tmp_path / "run.csv"), "--machine", SINGLE_AXIS, "-o", out)
    assert said.code == 2
    assert f"model {Found.model.identity}: {out}" in said.err
    assert out.read_text() == "found"


def test_compare_names_the_parameter_that_differs(daq: CommandLine, tmp_path: Path) -> None:
    heavier = tmp_path / "heavier.toml"
    heavier.write_text(SINGLE_AXIS.read_text().replace("0.8 ± 0.08 kg", "1.2 ± 0.08 kg"))
    trace = write_csv(tmp_path / "sine.csv")
    simulated = tmp_path / "simulated.csv"
    daq("simulate", SINGLE_AXIS, trace, "-o", simulated)
    page = tmp_path / "compared.html"
    said = daq("compare", SINGLE_AXIS, heavier, simulated, "--json", "--report", page)
    data = json.loads(said.out)
    assert [d["name"] for d in data["differences"]] == ["link1.mass"]
    assert data["differences"][0]["deviations"] == pytest.approx(5.0)
    errors = data["mean_squared_error"]
    assert errors["heavier"]["in_sample"] > 100 * errors["single_axis"]["in_sample"]
    assert "single_axis and heavier compared" in page.read_text()


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_fit_with_an_own_effect_finds_its_parameter(daq: CommandLine, tmp_path: Path) -> None:
    """The rig is integrated by a script that shares nothing with the model; the guide shows this very example."""
    first, second = rig_traces(tmp_path)
    out, page = tmp_path / "axis.json", tmp_path / "axis.html"
    words = ("fit", first, "--machine", SINGLE_AXIS, "--holdout", second, "-o", out, "--report", page, "--json")
    data = json.loads(daq(*words).out)
    found = {p["name"]: p for p in data["parameters"]}
    true = {"link1.mass": 0.87, "joint1.viscous_friction.coefficient": 0.035, "joint1.coulomb_friction.torque": 0.06}
    for name, value in true.items():
        assert found[name]["verdict"] == "known"
        assert found[name]["value"] == pytest.approx(value, rel=0.02)
    fitted = data["agreement"][1]
    assert fitted["held_out"][0]["rmse"] < 0.1 * data["agreement"][0]["held_out"][0]["rmse"]
    assert re.search(r"determine 5 of 5", page.read_text())
    assert daq("simulate", out, second).code == 0


# ---- `daq profile`: what a trace bounds on both sides, and what on one side alone


MASS, ROTOR = "link1.mass", "joint1.drive.inertia"


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the single axis without its controller, and three seconds of its swing."""
    folder = tmp_path_factory.mktemp("swing")
    begun, _, rest = SINGLE_AXIS.read_text("utf-8").partition("[controller]")
    (folder / "axis.toml").write_text(f"{begun}[[joints]]{rest.partition('[[joints]]')[2]}", "utf-8")
    rows = write_swing(folder / "swing.csv", 1).read_text("utf-8").splitlines()[:600]
    (folder / "swing.csv").write_text("\n".join([*rows, ""]), "utf-8")
    return folder


def test_profiles_are_written_as_json_csv_and_page(daq: CommandLine, swing: Path, tmp_path: Path) -> None:
    table, page = tmp_path / "profile.csv", tmp_path / "profile.html"
    asked = ("--parameter", MASS, "--parameter", ROTOR, "--no-priors")
    said = daq("profile", swing / "axis.toml", swing / "swing.csv", *asked, "-o", table, "--report", page, "--json")
    mass, rotor = json.loads(said.out)["profiles"]
    assert (mass["name"], rotor["name"]) == (MASS, ROTOR)
    assert 0.99 * mass["high"] < 0.8 < 1.01 * mass["low"]
    assert rotor["low"] < rotor["value"] < rotor["high"]
    with table.open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["parameter"] == MASS]
    assert [float(row["value"]) for row in rows] == pytest.approx(mass["values"], rel=1e-8)
    assert max(float(row["rise"]) for row in rows) > mass["rise"] * 0.99
    text = page.read_text("utf-8")
    assert "Profile likelihoods" in text
    assert MASS in text


def test_a_saved_fit_is_profiled_as_it_is_and_more_starts_fit_again(
    daq: CommandLine, swing: Path, tmp_path: Path
) -> None:
    fitted, trace = tmp_path / "fitted.json", swing / "swing.csv"
    daq("fit", trace, "--machine", swing / "axis.toml", "--no-priors", "-o", fitted)
    once = json.loads(daq("profile", fitted, trace, "--parameter", MASS, "--json").out)
    again = json.loads(daq("profile", fitted, trace, "--parameter", MASS, "--starts", 2, "--json").out)
    (one,), (other,) = once["profiles"], again["profiles"]
    assert one["value"] == pytest.approx(other["value"], abs=0.1 * (one["high"] - one["low"]))
    assert not one["better"]


def test_the_table_says_that_the_scale_of_torque_is_not_bounded(daq: CommandLine, swing: Path) -> None:
    """With the drive's gain free, mass, friction and gain may all be larger by one factor."""
    free = ("--parameters", "*.mass,*.gain,*.coefficient,*.inertia,*.torque", "--no-priors")
    said = daq("profile", swing / "axis.toml", swing / "swing.csv", "--parameter", MASS, *free)
    (line,) = [line for line in said.out.splitlines() if line.split()[:1] == [MASS]]
    assert line.split()[3] == "–"
    assert "do not bound it on this side" in said.out


def test_a_parameter_that_is_not_fitted_is_one_line_before_anything_is_computed(daq: CommandLine, swing: Path) -> None:
    said = daq("profile", swing / "axis.toml", swing / "swing.csv", "--parameter", "link1.length")
    said.complains(2, "--parameter link1.length: is not fitted; fitted are")
