"""`daq fit --torques` for a person: what it prints, what its page shows, and what it calls the traces."""

from pathlib import Path

import numpy as np
import pytest

from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import SINGLE_AXIS

LARGEST = 0.9
"""Of the recorded drive, V, in the records of which it stands at a limit."""
WORDS = ("--torques", "--machine", SINGLE_AXIS, "--parameters", "link1.mass,joint1.drive.inertia", "-o", "out.json")


def write_swing(path: Path, seed: int, limit: float | None = None) -> Path:
    """A hanging rod of 0.8 kg and 0.3 m that swings; the drive is cut off at a limit (V), the motion is not."""
    time = 0.005 * np.arange(1200)
    angle = 0.4 * np.sin(np.array([[2.1], [3.7], [6.0]]) * time + seed + np.arange(3)[:, None]).sum(axis=0)
    speed = np.gradient(angle, 0.005)
    torque = (0.8 * 0.3**2 / 3 + 0.004) * np.gradient(speed, 0.005) + 0.8 * 9.81 * 0.15 * np.sin(angle)
    torque += 0.02 * speed + 0.02 * np.sign(speed)
    drive = np.interp(time + 0.0035, time, torque) / 0.5  # it acts after 1 ms and is held for 5 ms
    if limit is not None:
        drive = np.clip(drive, -limit, limit)
    rows = np.column_stack([time, angle, angle, drive])
    np.savetxt(path, rows, delimiter=",", header="time,set_point_1,position_1,drive_1", comments="", fmt="%.9g")
    return path


@pytest.mark.timeout(300)
def test_parameters_errors_by_file_and_what_is_left_are_printed(daq: CommandLine) -> None:
    write_swing(Path("first.csv"), 1)
    write_swing(Path("second.csv"), 5)
    said = daq("fit", "first.csv", "--holdout", "second.csv", *WORDS)
    assert said.code == 0, said.err
    lines = said.out.splitlines()
    (mass,) = (line for line in lines if line.lstrip().startswith("link1.mass"))
    assert float(mass.split()[1]) == pytest.approx(0.8, rel=0.02)
    assert any(line.split()[:3] == ["first.csv", "in", "sample"] for line in lines)
    assert any(line.split()[:3] == ["second.csv", "held", "out"] for line in lines)
    assert any(line.startswith("left of the torque, all together: in sample ") for line in lines)
    assert "largest value" not in said.out
    assert "out.json" in said.err


@pytest.mark.timeout(300)
def test_a_drive_that_stood_at_its_limit_is_told_on_the_terminal_and_on_the_page(daq: CommandLine) -> None:
    write_swing(Path("clipped.csv"), 1, LARGEST)
    said = daq("fit", "clipped.csv", *WORDS, "--report", "page.html")
    assert said.code == 0, said.err
    note = "The recorded drive stands at its largest value ("
    assert note in said.out
    page = Path("page.html").read_text("utf-8")
    assert note in page
    assert "% of joint 1" in page
    assert "measured − simulated" not in page
    assert "clipped.csv" in page
    assert "page.html" in said.err


def test_an_error_calls_a_trace_as_the_command_line_does(daq: CommandLine) -> None:
    write_swing(Path("swing.csv"), 1)
    text = Path("swing.csv").read_text("utf-8").splitlines()
    Path("short.csv").write_text("\n".join(text[:100]) + "\n", "utf-8")
    Path("bare.csv").write_text("\n".join(line.rpartition(",")[0] for line in text) + "\n", "utf-8")
    daq("fit", "short.csv", *WORDS).complains(2, "daq: short.csv: lasts 0.485 s")
    daq("fit", "bare.csv", *WORDS).complains(2, "daq: bare.csv: has no recorded drive")
    daq("fit", "swing.csv", "swing.csv", *WORDS).complains(2, "daq: swing.csv: given more than once")
    daq("diagnose", "swing.csv", "--model", SINGLE_AXIS, "--holdout", "swing.csv").complains(
        2, "daq: swing.csv: is both fitted to and held out"
    )
