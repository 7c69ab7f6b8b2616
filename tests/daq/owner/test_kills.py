"""Ctrl-C and kill -9 of a run in the middle of its record: an excerpt of `python -m benchmarks kills`."""

from __future__ import annotations

import pytest

from benchmarks.kills import WAYS, Findings, Undisturbed, Way, end_one, undisturbed
from daq.contracts.machine import load_machine

pytestmark = [pytest.mark.slow, pytest.mark.against_the_clock]


@pytest.fixture(scope="module")
def whole() -> Undisturbed:
    """The run that the others are held against."""
    return undisturbed()


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_whatever_ends_a_run_leaves_nothing_running_a_free_port_a_still_arm_and_no_wrong_sample(
    way: Way, whole: Undisturbed
) -> None:
    findings = Findings()
    end_one(way, 0.0, whole, load_machine("ma2000"), findings, recording=True)
    assert findings.wrong == []
    assert findings.samples > 50 or not way.freezes  # of a process that is killed, what was synced is left
    assert "complete" not in next(iter(findings.met))
