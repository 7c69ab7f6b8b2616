"""Which file is a bag, and which joints of one are a machine's."""

from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.joint_matching import check_joints
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from extras.formats.bags import PLUGIN
from extras.formats.bags.ros_bag import import_bag
from tests.daq.traces.samples import record, write
from tests.daq.traces.test_files import csv
from tests.extras.formats.bags.test_ros_bag import bag, imported


def test_a_files_content_says_what_it_is(tmp_path: Path) -> None:
    table, trace = csv(tmp_path / "RIG.CSV", "0,1", "0.1,2"), write(tmp_path / "a.mcap", 3)
    (made,) = bag(tmp_path / "bag", [{}] * 3, "sqlite3").glob("*.db3")
    renamed = [trace.rename(tmp_path / "TRACE.dat"), made.rename(tmp_path / "BAG.DB3")]
    assert [kind_of(path) for path in (table, *renamed)] == ["csv", "trace", PLUGIN.importers[0]]
    assert (len(open_trace(table)), len(open_trace(renamed[0])), len(imported(renamed[1]))) == (2, 3, 3)
    with pytest.raises(TraceError, match="its effort may be in N·m"):
        open_trace(renamed[1])


def named(*names: str) -> Machine:
    """The MA2000 with joints of these names."""
    machine = load_machine("ma2000")
    joints = tuple(j.model_copy(update={"name": n}) for j, n in zip(machine.joints, names, strict=False))
    return machine.model_copy(update={"joints": joints})


def test_joints_are_matched_by_name_and_never_by_the_order_that_they_came_in(tmp_path: Path) -> None:
    names = {"names": ["elbow", "pan", "lift"], "position": [3.0, 1.0, 2.0], "effort": []}
    path = bag(tmp_path / "ur", [names] * 3)
    machine = named("pan", "lift", "elbow")
    matched = import_bag(path, choice=Choice(numbering=("pan", "lift", "elbow")))
    assert (matched.joints, matched.record.joint_names) == ((3, 1, 2), ("elbow", "pan", "lift"))
    check_joints(read_trace(write_trace(matched, tmp_path / "a.mcap")), machine)
    unmatched = import_bag(path)
    with pytest.raises(
        TraceError, match=r"its joints are 1 elbow, 2 pan, 3 lift, .* again with --joints pan,lift,elbow$"
    ):
        check_joints(unmatched, machine)
    with pytest.raises(TraceError, match="--joints and its own names for base, shoulder, upper, in this"):
        check_joints(unmatched, named("base", "shoulder", "upper"))
    chosen = import_bag(path, choice=Choice(joints=("pan", "lift", "elbow")))
    assert np.array_equal(chosen.position[0], [1.0, 2.0, 3.0])
    check_joints(chosen, machine)
    check_joints(chosen, named("base", "shoulder", "upper"))  # a person has said which is which
    check_joints(Trace(record(machine=None), (1, 2), np.arange(3.0), np.zeros((3, 2))), machine)  # names nothing
