"""A run of an arm whose memory map leaves out the gains: its record says that no limp joint can be seen."""

from pathlib import Path

from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import load_machine
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from tests.daq.driver.test_what_the_map_leaves_out import GAINS, MOCK, without
from tests.daq.runner.rig import Rig


def notes_of(folder: Path, *absent: str) -> list[str]:
    with Controller.connect(MOCK, without(*absent)) as controller:
        assert controller.link.control is not None
        arm = Rig(controller, ArmControl(controller), folder, load_machine("ma2000"), controller.link.control)
        trace = arm.trace(arm.run())
    assert (trace.record.gains is None) == bool(absent)
    return [event.message for event in trace.events if event.kind == "note"]


def test_a_run_without_known_gains_says_so_in_its_record(tmp_path: Path) -> None:
    assert GAINS_UNKNOWN in notes_of(tmp_path, *GAINS)
    assert GAINS_UNKNOWN not in notes_of(tmp_path)
