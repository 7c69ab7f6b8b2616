"""`daq fit --consistent-inertias`: the hand-written swing, on a machine whose link is a body."""

import json
from pathlib import Path

import numpy as np
import pytest

from model.machine_model.model_file import load_model
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import SINGLE_AXIS

ROD = 'link = { mass = "0.8 ± 0.08 kg" }'
MOMENTS = ("link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz")


def machine(tmp_path: Path, zz: float) -> Path:
    """The single axis with a body: 6 cm thick and 30 cm long, but for the moment about its axis."""

    text = SINGLE_AXIS.read_text("utf-8")
    assert ROD in text
    file = tmp_path / "body.toml"
    file.write_text(
        text.replace(ROD, f"link = {{ mass = 0.8, centre = [-0.15, 0.0, 0.0], inertia = [0.0005, 0.006, {zz}] }}"),
        "utf-8",
    )
    return file


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """A swing whose rotor is heavier than the model thinks: 0.02 kg·m² more about the axis."""
    time = 0.005 * np.arange(1200)
    angle = 0.4 * np.sin(np.array([[2.1], [3.7], [6.0]]) * time + np.arange(3)[:, None]).sum(axis=0)
    speed = np.gradient(angle, 0.005)
    torque = (0.8 * 0.15**2 + 0.006 + 0.004 + 0.02) * np.gradient(speed, 0.005) + 0.8 * 9.81 * 0.15 * np.sin(angle)
    late = np.interp(time + 0.0035, time, torque)  # the drive acts after 1 ms and is held for 5 ms
    path = tmp_path / "swing.csv"
    rows = np.column_stack([time, angle, angle, late / 0.5])
    np.savetxt(path, rows, delimiter=",", header="time,set_point_1,position_1,drive_1", comments="", fmt="%.9g")
    return path


@pytest.mark.timeout(300)
def test_a_fit_of_torques_finds_a_body_that_can_exist_and_says_that_it_is_flat(
    daq: CommandLine, tmp_path: Path, swing: Path
) -> None:
    words = ("fit", swing, "--torques", "--machine", machine(tmp_path, 0.006), "--effects", "none")
    found = {}
    for name, options in (("plain", ()), ("consistent", ("--consistent-inertias",))):
        said = daq(*words, "-o", tmp_path / f"{name}.json", "--parameters", "link1.inertia_??", "--json", *options)
        assert json.loads(said.out)["on_the_edge"] == (["link1"] if options else [])
        fitted = load_model(tmp_path / f"{name}.json")
        found[name] = [fitted.parameter(p).value for p in MOMENTS]
    xx, yy, zz = found["plain"]
    assert zz == pytest.approx(0.026, rel=0.02)
    assert xx + yy < zz
    xx, yy, zz = found["consistent"]
    assert zz == pytest.approx(0.026, rel=0.02)
    assert xx + yy > zz
    shown = daq(*words, "-o", tmp_path / "c.json", "--parameters", "link1.inertia_??", "--consistent-inertias")
    assert "link1: flat or thin after the fit; the traces ask for a body that cannot exist" in " ".join(
        shown.out.split()
    )


@pytest.mark.timeout(300)
@pytest.mark.parametrize("torques", [("--torques",), ()])
def test_a_body_that_cannot_exist_and_half_a_choice_are_refused_in_one_line(
    daq: CommandLine, tmp_path: Path, swing: Path, torques: tuple[str, ...]
) -> None:
    def refused(file: Path, parameters: str, *says: str) -> None:
        words = ("fit", swing, *torques, "--machine", file, "-o", tmp_path / "no.json", "--consistent-inertias")
        daq(*words, "--parameters", parameters).complains(2, *says)
        assert not (tmp_path / "no.json").exists()

    refused(machine(tmp_path, 0.02), "link1.mass", "link1: 0.8 kg", "0.0005, 0.006, 0.02", "is not physically consistent")
    refused(machine(tmp_path, 0.006), "link1.inertia_zz", "link1.inertia_zz", "fit", "link1.inertia_xx")
