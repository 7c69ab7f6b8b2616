"""The first day from a port to an acceptance sheet, in lock-step, with an arm of which nothing is known beforehand."""

import json
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq.config.robot_files import load_memory_map
from daq.contracts.machine import BoardPid, load_machine
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from extras.commissioning.command.steps import STEPS
from mock_controller.board.parameters import default_board
from mock_controller.hidden.memory import draw_memory
from mock_controller.hidden.sensors import draw_sensors
from tests.control_port import told_by
from tests.daq_cli.invoke import CommandLine, Said

SENSORS, MAP = 3, 7
"""Seeds of what is secret."""
WITHOUT_GAINS = 2611
"""Seed of a memory whose gains, outputs and gripper no search finds."""
FOUND = ("set_point", "position", "error", "power")
"""Registers that a search proves at every joint."""


@contextmanager
def mock(options: str) -> Iterator[MockProcess]:
    """A mock in lock-step with secret sensors."""
    port = parse_port_url(f"mock://?lock_step=1&seed=5&secret_sensors={SENSORS}&{options}")
    assert isinstance(port, MockPort)
    found = start_mock(port)
    try:
        yield found
    finally:
        found.close()


def commission(daq: CommandLine, arm: MockProcess, folder: Path, *options: str) -> Said:
    """`daq commission` with the mock's hand in place of a person's."""
    assert arm.control is not None
    port = f"{arm.url}?lock_step=1"
    return daq(
        "--port", port, "commission", "--folder", folder, "--mock-control", arm.control, "--yes", "--json", *options
    )


def holds_the_truth(folder: Path, joints: tuple[int, ...]) -> bool:
    """Whether the machine file has the secret sensors of these joints: each direction, range and zero."""
    machine, truth = load_machine(str(folder / "machine.toml")), draw_sensors(SENSORS, default_board().calibrations)
    for joint in joints:
        found, true = machine.calibration(joint), truth[joint - 1]
        assert found.direction == true.direction
        assert found.range_rad == pytest.approx(true.range_rad, abs=0.05)
        assert found.angle_at_zero_rad == pytest.approx(true.angle_at_zero_rad, abs=0.03)
    return {machine.calibration(joint).direction for joint in joints} == {-1, 1}


LEFT_OUT = ("memory", "potentiometers", "end_stops", "emergency_stop", "gain", "first_ramp", "ramp", "model")


def test_the_bridge_the_stop_and_the_timing_of_an_arm_with_a_known_map(daq: CommandLine, tmp_path: Path) -> None:
    daq("config", "copy", "memory-map", "-o", tmp_path / "memory_map.toml")
    with mock("") as arm:
        said = commission(daq, arm, tmp_path, *(word for name in LEFT_OUT for word in ("--skip", name)))
    assert said.code == 0, said.err
    steps = json.loads(said.out)["steps"]
    assert [name for name, one in steps.items() if not one.get("skipped")] == [
        "line",
        "bridge",
        "stop",
        "period",
        "delay",
    ]
    assert steps["period"]["period_ms"] == pytest.approx(20.0, abs=0.01)
    true = 1e-3 * default_board().timing.computing_delay
    assert steps["delay"]["lowest_ms"] <= true <= steps["delay"]["highest_ms"]
    controller = load_machine(str(tmp_path / "machine.toml")).controller
    assert isinstance(controller, BoardPid)
    assert not controller.delay.assumed
    assert controller.delay.value == pytest.approx(1e-3 * true, abs=0.001)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_an_arm_whose_gains_and_gripper_nobody_knows_is_commissioned_without_them(
    daq: CommandLine, tmp_path: Path
) -> None:
    secret = f"secret_map={WITHOUT_GAINS}"
    with mock(secret) as arm:
        said = commission(daq, arm, tmp_path)
        assert said.code == 3
        assert "make firmware MAP=" in said.err
    absent = tomllib.loads((tmp_path / "commissioning.toml").read_text("utf-8"))["step"]["memory"]["absent"]
    assert absent == ["gain_p", "gain_i", "gain_d", "process_outputs", "gripper"]
    skipped = [word for name in ("potentiometers", "end_stops", "emergency_stop") for word in ("--skip", name)]
    with mock(f"{secret}&memory_map={tmp_path / 'memory_map.toml'}") as arm:
        said = commission(daq, arm, tmp_path, *skipped, "--skip", "delay", "--skip", "gain", "--skip", "model")
        written = told_by(str(arm.control), "written")["written"]
    assert said.code == 0, said.err
    steps = json.loads(said.out)["steps"]
    assert steps["ramp"]["outcome"] == "complete"
    assert steps["ramp"]["set_points_taken_late"] == 0
    truth = draw_memory(WITHOUT_GAINS, "kept").map["set_point"]
    assert {int(address, 16) for address in written} <= set(truth.addresses), "what has no place is never written"
    page = (tmp_path / "acceptance.html").read_text("utf-8")
    assert "left out: no place is known" in page
    assert "sensors of joints 1, 2, 3, 4, 5, 6" in page


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_with_a_secret_memory_map_and_secret_sensors_every_step_is_done_in_the_end(
    daq: CommandLine, tmp_path: Path
) -> None:
    with mock(f"secret_map={MAP}") as arm:
        said = commission(daq, arm, tmp_path)
        assert said.code == 3
        assert "it uses another map" in said.err
        written = told_by(str(arm.control), "written")["written"]
    assert set(tomllib.loads((tmp_path / "commissioning.toml").read_text("utf-8"))["step"]) == {"line", "memory"}
    found, truth = load_memory_map(tmp_path / "memory_map.toml"), draw_memory(MAP, "kept").map
    for name in FOUND:
        assert (found[name].low, found[name].high) == (truth[name].low, truth[name].high), name
    assert {int(address, 16) for address in written} <= set(truth["set_point"].low), "written where nothing is proved"
    with mock(f"secret_map={MAP}&memory_map={tmp_path / 'memory_map.toml'}") as arm:
        said = commission(daq, arm, tmp_path)
    assert said.code == 0, said.err
    steps = json.loads(said.out)["steps"]
    assert list(steps) == [step.name for step in STEPS]
    assert not any(step.get("skipped") for step in steps.values())
    assert holds_the_truth(tmp_path, (1, 2, 3))
    assert steps["first_ramp"]["outcome"] == steps["ramp"]["outcome"] == "complete"
    page = (tmp_path / "acceptance.html").read_text("utf-8")
    assert f"{len(STEPS)} of {len(STEPS)} steps are done, 0 are left out, 0 are open." in page
