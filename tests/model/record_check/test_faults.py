"""Each fault in the records of each rig is said with its place, and rigs as they are raise no doubt."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from mock_controller.hidden.sizes import LATER_SIZES, SHARED_SIZES, SizeRange, draw_values
from model.machine_model.model import base_model
from model.record_check.check import check_records
from model.record_check.finding import RecordFinding, doubts_in
from tests.model.record_check.faults import FAULTS, Faulty
from tests.model.record_check.rigs import RIGS, mock, world

NOT_TOLD = {("linear_axis", "late_drive"), ("planar-torques", "late_drive"), ("mock", "dead_at_the_beginning")}
"""Faults that a record does not hold: one sample is within friction that takes nearly all torque, or within noise; a
joint stops within two periods of the mock elsewhere in the second half of its ramp."""
ONLY_NOTED = {"late_drive", "wraps", "slow_times", "cut_out"}
"""Faults that may be said as a note: wraps that are taken out; gaps, where a record without a controller is cut; and
what such a record leaves open."""
NEAR = 0.3
"""s between a drawn place and where it is said: a reading that is stuck may have rested before."""


@cache
def rig(name: str) -> tuple[Machine, Trace]:
    with TemporaryDirectory() as folder:
        return RIGS[name](Path(folder))


def said(found: tuple[RecordFinding, ...], fault: Faulty) -> list[RecordFinding]:
    """The findings that say a fault, at its joint and its time."""
    return [
        one
        for one in found
        if one.kind in fault.kinds
        and (fault.joint is None or one.joint == fault.joint)
        and (fault.time is None or any(abs(time - fault.time) < NEAR for time in one.times))
    ]


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("kind", FAULTS)
@settings(max_examples=3, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_fault_is_said_with_its_place(name: str, kind: str, seed: int) -> None:
    machine, trace = rig(name)
    fault = FAULTS[kind](trace, machine, np.random.default_rng(seed))
    if fault is None or (name, kind) in NOT_TOLD:
        return
    found = check_records(base_model(machine), [fault.trace])
    lines = [one.line for one in found]
    assert said(found, fault), lines
    assert kind in ONLY_NOTED or doubts_in(found), lines


@pytest.mark.parametrize("name", RIGS)
def test_a_rig_as_it_is_raises_no_doubt(name: str) -> None:
    machine, trace = rig(name)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()


@pytest.mark.slow
@pytest.mark.parametrize("size", [*SHARED_SIZES, *LATER_SIZES], ids=lambda size: size.effect)
def test_an_effect_hidden_in_the_mock_is_no_fault_of_the_record(size: SizeRange, tmp_path: Path) -> None:
    joint = 2 if size.acts_on_joints else None
    values = draw_values(Random(1), size, joint, 1.0, 1)
    effect = f"{size.effect}:{','.join(f'{name}={value}' for name, value in values.items())}"
    machine, trace = mock(effect, experiment="diagnostic-b")(tmp_path)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["axis-pid", "axis-current", "planar-pid", "planar-board", "planar-torques"])
@pytest.mark.parametrize("case", ["sound", "single", "pair", "open"])
@pytest.mark.parametrize("seed", range(21, 24))
def test_what_worlds_hide_is_no_fault_of_the_record(kind: str, case: str, seed: int, tmp_path: Path) -> None:
    machine, trace = world(kind, seed, case)(tmp_path)
    assert doubts_in(check_records(base_model(machine), [trace])) == ()
