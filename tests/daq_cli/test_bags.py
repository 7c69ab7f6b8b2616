"""`daq traces import` of somebody else's bag: what is chosen, what is told, and what cannot be."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from daq.traces.reader import read_trace
from tests.daq.traces.samples import write
from tests.daq.traces.test_ros_bag import bag
from tests.daq_cli.invoke import CommandLine


def test_the_joints_that_are_named_become_a_trace(daq: CommandLine, tmp_path: Path) -> None:
    path = bag(tmp_path / "a", [{}] * 5, topics=("/left", "/right"))
    words = ("--topic", "/right", "--joints", "lift, pan", "--received", "--folder", tmp_path / "kept", "--json")
    made = json.loads(daq("traces", "import", path, *words).out)
    trace = read_trace(Path(made["file"]))
    np.testing.assert_array_equal(trace.position, [[-0.2 * k, 0.1 * k] for k in range(5)])
    assert "From topic /right, joints 1 lift, 2 pan." in trace.record.notes
    assert "Times are those at which messages were received." in trace.record.notes
    shown = daq("traces", "show", made["file"])
    assert (shown.code, "5 samples on joints 1, 2" in shown.out) == (0, True)


def test_what_is_no_bag_or_leaves_a_choice_is_told_in_one_line(daq: CommandLine, tmp_path: Path) -> None:
    two = bag(tmp_path / "two", [{}], topics=("/left", "/right"))
    daq("traces", "import", two).complains(2, "joint states on /left, /right; choose one with --topic")
    daq("traces", "import", write(tmp_path / "a.mcap")).complains(2, "is a trace already")
    (tmp_path / "rig.csv").write_text("time,position_1\n0,0\n1,1\n")
    daq("traces", "import", tmp_path / "rig.csv", "--topic", "/left").complains(2, "are for bags; this is none")
    daq("traces", "import", tmp_path / "absent.bag").complains(2, "absent.bag: ")
    (tmp_path / "two.toml").write_text("topics = '/left'\n")
    daq("traces", "import", two).complains(2, "two.toml", "topics")
