"""Which file is a bag, and which joints of one are a machine's."""

from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.joint_matching import matched
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
    numbered = import_bag(path, choice=Choice(numbering=("pan", "lift", "elbow")))
    assert (numbered.joints, numbered.record.joint_names) == ((3, 1, 2), ("elbow", "pan", "lift"))
    kept = read_trace(write_trace(numbered, tmp_path / "a.mcap"))
    assert matched(kept, machine) is kept
    in_order = import_bag(path)
    assert in_order.joints == (1, 2, 3)
    assert matched(in_order, machine).joints == (3, 1, 2)
    with pytest.raises(TraceError, match="--joints and its own names for base, shoulder, upper, in this"):
        matched(in_order, named("base", "shoulder", "upper"))
    chosen = import_bag(path, choice=Choice(joints=("pan", "lift", "elbow")))
    assert np.array_equal(chosen.position[0], [1.0, 2.0, 3.0])
    assert matched(chosen, machine) is chosen
    assert matched(chosen, named("base", "shoulder", "upper")) is chosen  # a person has said which is which
    without = Trace(record(machine=None), (1, 2), np.arange(3.0), np.zeros((3, 2)))
    assert matched(without, machine) is without


def test_joints_that_a_machine_lacks_are_left_out_by_their_names(tmp_path: Path) -> None:
    names = {"names": ["grip", "elbow", "pan", "lift"], "position": [9.0, 3.0, 1.0, 2.0], "effort": []}
    path = bag(tmp_path / "ur", [names] * 3)
    machine = named("pan", "lift", "elbow")
    trace = import_bag(path)
    assert trace.joints == (1, 2, 3, 4)
    fitting = matched(trace, machine)
    assert (fitting.joints, fitting.record.joint_names) == ((3, 1, 2), ("elbow", "pan", "lift"))
    assert [fitting.position[0, fitting.column(joint)] for joint in (1, 2, 3)] == [1.0, 2.0, 3.0]
    assert import_bag(path, choice=Choice(numbering=("pan", "lift", "elbow"))).joints == (3, 1, 2)
