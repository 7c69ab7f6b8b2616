"""An effect of the user's own, through every command that takes one."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from model.effects.library import own_effects, remove_own
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import ROOT, SINGLE_AXIS

AIR_DRAG = ROOT / "examples" / "air_drag.py"
EFFECT_FILE = ("--effect-file", AIR_DRAG)
DRAG, COULOMB, VISCOUS, MASS = 0.015, 0.06, 0.035, 0.87


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """A process reads a file once and keeps its effect; here every command is to find an empty library."""
    yield
    forget()


def forget() -> None:
    for name in own_effects():
        remove_own(name)


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """An axis dragged by the air, its torque worked out by hand from a motion: sums of sines, 10 s."""
    time = 0.005 * np.arange(2000)
    rates = np.array([[2.1], [3.7], [6.0]])
    angle = 0.4 * np.sin(rates * time + np.arange(3)[:, None]).sum(axis=0)
    speed = np.gradient(angle, 0.005)
    torque = (MASS * 0.09 / 3 + 0.0044) * np.gradient(speed, 0.005) + MASS * 9.81 * 0.15 * np.sin(angle)
    torque += VISCOUS * speed + COULOMB * np.sign(speed) + DRAG * np.abs(speed) * speed
    late = np.interp(time + 0.0035, time, torque)  # the drive acts after 1 ms and is held for 5 ms
    path = tmp_path / "swing.csv"
    rows = np.column_stack([time, angle, angle, late / 0.5])
    np.savetxt(path, rows, delimiter=",", header="time,set_point_1,position_1,drive_1", comments="", fmt="%.9g")
    return path


@pytest.fixture
def beginning(swing: Path) -> Path:
    """Its first second and a half: enough for commands that find no value in it."""
    path = swing.with_name("beginning.csv")
    path.write_text("\n".join(swing.read_text().splitlines()[:300]) + "\n")
    return path


@pytest.fixture
def dragged(daq: CommandLine, tmp_path: Path, swing: Path) -> Path:
    """The model with the user's effect, fitted to the swing."""
    model = tmp_path / "drag.json"
    effects = ("--effects", "viscous,coulomb,air_drag", "--hold", "controller.delay", "--no-priors")
    said = daq("fit", swing, "--torques", "--machine", SINGLE_AXIS, "-o", model, "--json", *effects, *EFFECT_FILE)
    found = {p["name"]: p["value"] for p in json.loads(said.out)["parameters"]}
    assert found["link1.mass"] == pytest.approx(MASS, rel=0.01)
    assert found["joint1.air_drag.coefficient"] == pytest.approx(DRAG, rel=0.1)
    return model


@pytest.mark.timeout(300)
def test_an_effect_file_is_used_by_fit_and_simulate(daq: CommandLine, dragged: Path, beginning: Path) -> None:
    simulated = daq("simulate", dragged, beginning, "--json", *EFFECT_FILE)
    assert math.isfinite(json.loads(simulated.out)["agreement"]["in_sample"][0]["rmse"])


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_an_effect_file_is_used_by_compare_and_validate(daq: CommandLine, dragged: Path, beginning: Path) -> None:
    compared = json.loads(daq("compare", dragged, SINGLE_AXIS, beginning, "--json", *EFFECT_FILE).out)
    assert "joint1.air_drag.coefficient" in {d["name"] for d in compared["differences"]}
    words = ("validate", dragged, beginning, "--parameters", "*air_drag*", "--json", *EFFECT_FILE)
    assert [p["name"] for p in json.loads(daq(*words).out)["fidelity"]["parameters"]] == ["joint1.air_drag.coefficient"]


@pytest.mark.parametrize("command", ["simulate", "validate"])
def test_a_model_that_needs_an_effect_file_names_it(
    daq: CommandLine, tmp_path: Path, swing: Path, command: str
) -> None:
    model = tmp_path / "drag.json"
    words = ("--effects", "air_drag", "--effect-file", AIR_DRAG)
    daq("fit", swing, "--torques", "--machine", SINGLE_AXIS, "-o", model, *words)
    forget()
    daq(command, model, swing).complains(2, "air_drag.py", "--effect-file")


@pytest.mark.parametrize(
    ("text", "told"), [(None, "cannot be read"), ("1/0", "ZeroDivisionError"), ("x = 1", "states no effect")]
)
def test_a_file_without_an_effect_is_refused_in_one_line(
    daq: CommandLine, tmp_path: Path, swing: Path, text: str | None, told: str
) -> None:
    file = tmp_path / "wrong.py"
    if text is not None:
        file.write_text(text)
    daq("simulate", SINGLE_AXIS, swing, "--effect-file", file).complains(2, "wrong.py", told)
