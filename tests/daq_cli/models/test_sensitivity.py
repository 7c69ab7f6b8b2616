"""`daq sensitivity`: which parameter moves which joint's response, and when."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from daq.traces.store import write_trace
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.daq_cli.invoke import CommandLine
from tests.model.simulation.records import ramp_trace

BACK_EMF, LOAD = "joint2.motor.back_emf_constant", "load.mass"


@pytest.fixture(scope="module")
def ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The experiment's ramp step on a trace."""
    return write_trace(ramp_trace(load_machine("ma2000")), tmp_path_factory.mktemp("ramp") / "ramp.mcap")


def test_sensitivity_curves_equal_simulated_changes_and_are_written_as_csv(
    daq: CommandLine, ramp: Path, tmp_path: Path
) -> None:
    said = daq("sensitivity", "ma2000", ramp, "--parameters", f"{BACK_EMF},{LOAD}", "-o", tmp_path / "c.csv", "--json")
    found = json.loads(said.out)
    curve = next(c for c in found["curves"] if c["name"] == BACK_EMF)
    model, plain = base_model(load_machine("ma2000")), Options(quantise=False)
    moved = model.with_values({BACK_EMF: model.parameter(BACK_EMF).value + 0.01 * curve["expected"]})
    trace = ramp_trace(model.machine)
    change = 100 * (simulate(moved, trace, plain).reading - simulate(model, trace, plain).reading)
    assert np.abs(np.transpose(curve["by_joint"]) - change).max() < 0.02 * np.abs(change).max()
    with (tmp_path / "c.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(found["time"])
    written = [float(row[f"{BACK_EMF}@joint2"]) for row in rows]
    assert written == pytest.approx(curve["by_joint"][1], rel=1e-6, abs=1e-12)


def test_the_table_names_the_joint_and_the_moment_and_the_strongest_parameter_first(
    daq: CommandLine, ramp: Path, tmp_path: Path
) -> None:
    page, picture = tmp_path / "page.html", tmp_path / "curves.svg"
    said = daq("sensitivity", "ma2000", ramp, "--parameters", f"link1.mass,{BACK_EMF}", "--report", page, "-o", picture)
    lines = [line for line in said.out.splitlines() if " at " in line and line.split()[0] in (BACK_EMF, "link1.mass")]
    assert [line.split()[0] for line in lines] == [BACK_EMF, "link1.mass"]
    by_joint = [float(cell.rstrip("°")) for cell in lines[0].split() if cell.endswith("°")]
    assert len(by_joint) == 3
    assert max(range(3), key=lambda j: abs(by_joint[j])) == 1
    assert f"{BACK_EMF} moves the readings most" in page.read_text("utf-8")
    assert "joint 3" in picture.read_text("utf-8")


def test_wrong_options_of_sensitivity_are_refused_in_one_line(daq: CommandLine, ramp: Path, tmp_path: Path) -> None:
    daq("sensitivity", "ma2000", ramp, "-o", tmp_path / "curves.xyz").complains(2, "curves.xyz", ".csv", ".png")
    daq("sensitivity", "ma2000", ramp, "--parameters", "link9.mass").complains(2, "link9.mass")
    daq("sensitivity", "ma2000", ramp, "--open-loop").complains(2, "no drive")
