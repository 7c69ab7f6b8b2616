"""What a memory map leaves out is neither read nor written, by the mock's bridge and by that in C."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq.contracts.errors import SafetyError
from daq.driver import Controller
from daq.link import RequestRefusedError
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import GAIN_REGISTERS, default_memory_map, memory_map_text, parse_memory_map
from mock_controller.hidden.memory import draw_memory
from tests.control_port import told_by
from tests.daq.runner.rig import SHORT, rig
from tests.firmware.process import served

SEED = 7


def without(folder: Path, *absent: str) -> Path:
    """The true map of a secret memory without some registers, as a file."""
    whole = draw_memory(SEED, "kept").map
    left = {name: register for name, register in whole.registers.items() if name not in absent}
    path = folder / "partial.toml"
    path.write_text(memory_map_text(whole.model_copy(update={"registers": left, "name": "partial"})), "utf-8")
    return path


@contextmanager
def controller(bridge: str, memory_map: Path) -> Iterator[tuple[Controller, str]]:
    """The controller behind a bridge that works by this map, and its control port."""
    if bridge == "mock":
        with Controller.connect(f"mock://?lock_step=1&seed=1&secret_map={SEED}&memory_map={memory_map}") as found:
            assert found.link.control is not None
            yield found, found.link.control
        return
    with served(bridge, "--secret-map", str(SEED), "--memory-map", str(memory_map)) as process:
        assert process.control is not None
        with Controller.connect(process.url) as found:
            yield found, process.control


@pytest.mark.parametrize("bridge", ["mock", "hosted"])
def test_without_gains_and_gripper_the_bridge_refuses_them_and_writes_nothing(bridge: str, tmp_path: Path) -> None:
    with controller(bridge, without(tmp_path, *GAIN_REGISTERS, "gripper")) as (robot, control):
        assert robot.gains() == {}
        for refused in (
            lambda: robot.set_gains(1, 2, 0, 0),
            robot.process,
            lambda: robot.write_outputs(1, 1),
            lambda: robot.set_gripper(closed=True),
        ):
            with pytest.raises(RequestRefusedError, match="memory map lacks the registers"):
                refused()
        assert set(robot.errors_positions_powers()) == {1, 2, 3, 4, 5, 6}
        assert told_by(control, "written")["written"] == {}


def test_an_arm_without_gains_runs_and_its_record_has_none(tmp_path: Path) -> None:
    path = without(tmp_path, *GAIN_REGISTERS)
    with rig(tmp_path, f"seed=1&secret_map={SEED}&memory_map={path}") as arm:
        result = arm.run()
        assert result.outcome == "complete"
        assert arm.trace(result).record.gains is None
        with pytest.raises(SafetyError, match="has no gains"):
            arm.run(SHORT.model_copy(update={"gains": {1: (3, 0, 0)}}))


def test_a_map_without_one_of_the_gains_or_without_a_set_point_is_none() -> None:
    whole = default_memory_map()
    for absent, says in (("gain_d", "give all of gain_p, gain_i, gain_d"), ("set_point", "set_point is missing")):
        left = {name: register for name, register in whole.registers.items() if name != absent}
        text = memory_map_text(whole.model_copy(update={"registers": left}))
        with pytest.raises(MemoryMapError, match=says):
            parse_memory_map(text)
