"""`daq profile`: what a trace bounds on both sides, and what on one side alone."""

import csv
import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from daq.contracts.trace import Trace, TraceRecord
from daq.traces.store import write_trace
from model.arrays import Floats
from tests.daq_cli.invoke import CommandLine

LENGTH, PERIOD, SAMPLES = 0.3, 0.01, 600
NOISE_COUNTS = 20.0
TRUTH = {"link1.mass": 0.93, "joint1.viscous_friction.coefficient": 0.03, "joint1.drive.inertia": 0.0043}
MACHINE = f"""
name = "rod"
title = "A hanging rod"
gravity = [9.81, 0.0, 0.0]

[[joints]]
name = "axis"
geometry = {{ a = {LENGTH} }}
link = {{ mass = "0.8 ± 0.2 kg" }}
drive = {{ gain = "1 N·m/V", inertia = "0.003 ± 0.003 kg·m²" }}
friction = {{ viscous = "0.02 ± 0.02 N·m·s/rad" }}
sensor = {{ bits = 16, noise = {NOISE_COUNTS} }}
"""
MASS, VISCOUS, ROTOR = TRUTH


def rod_record() -> Trace:
    """Six seconds of the rod: torque held for each sample, angle with white noise but for the first reading.

    SciPy integrates its equation (DOP853, 1e-10). The torque changes so slowly that the rotor's inertia hardly shows.
    """
    time = np.asarray(PERIOD * np.arange(SAMPLES), dtype=np.float64)
    torque = np.sum([0.3 * np.sin(rate * time + phase) for phase, rate in enumerate((0.15, 0.25, 0.4))], axis=0)
    torque = torque * np.sin(np.pi * time / time[-1]) ** 2  # gently, so that the rod never swings by itself
    mass, viscous, rotor = TRUTH.values()
    inertia, weight = mass * LENGTH**2 / 3 + rotor, mass * 9.81 * LENGTH / 2
    state, angles = np.zeros(2), [0.0]
    for held in torque[:-1]:

        def slope(_time: float, y: Floats, held: float = held) -> Floats:
            return np.array([y[1], (held - viscous * y[1] - weight * np.sin(y[0])) / inertia])

        state = solve_ivp(slope, (0.0, PERIOD), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        angles.append(float(state[0]))
    noise = NOISE_COUNTS * 2 * np.pi / 2**16 * np.random.default_rng(1).normal(size=SAMPLES)
    noise[0] = 0.0
    record = TraceRecord(
        trace_id="rod",
        created=datetime(2024, 1, 1, tzinfo=UTC),
        software="test",
        source="imported",
        period=PERIOD,
        drive_unit="V",
    )
    position = np.asarray(np.array(angles) + noise, dtype=np.float64)[:, None]
    return Trace(record, (1,), time, position, drive=np.asarray(torque, dtype=np.float64)[:, None])


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a hanging rod's machine file and a slow record of it."""
    folder = tmp_path_factory.mktemp("rod")
    (folder / "rod.toml").write_text(MACHINE, "utf-8")
    write_trace(rod_record(), folder / "rod.mcap")
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
