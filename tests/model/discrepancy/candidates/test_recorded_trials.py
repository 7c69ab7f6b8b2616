"""Trial sizes that follow from the recorded drive."""

from __future__ import annotations

from dataclasses import replace

from model.discrepancy.candidates.library import hypotheses
from model.discrepancy.candidates.recorded_trials import SHARES, with_recorded_trials
from model.discrepancy.output_error.observation import Observation, observe
from tests.model.fitting import imagined


def driven(volts: float) -> Observation:
    """A record whose drive never exceeds so much."""
    observation, _ = observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=1.0)])
    records = []
    for r in observation.records:
        scaled = r.inputs.drive * 0.0
        scaled[0] = volts
        records.append(replace(r, inputs=replace(r.inputs, drive=scaled, has_drive=True)))
    return replace(observation, records=tuple(records))


def test_a_limit_is_tried_below_the_largest_recorded_drive() -> None:
    (limit,) = hypotheses(imagined.arm(), ("supply_limit",), (2,))
    (name,) = (p.name for p in limit.main)
    assert all(trial[name] > 3.0 for trial in limit.trials), "the usual ones are of the supply"
    tried = with_recorded_trials(limit, driven(3.0)).trials
    assert [t[name] for t in tried if t[name] < 3.0] == [3.0 * share for share in SHARES]


def test_trials_that_the_record_reaches_stay_as_they_are() -> None:
    (limit,) = hypotheses(imagined.arm(), ("supply_limit",), (2,))
    (friction,) = hypotheses(imagined.arm(), ("dead_zone",), (2,))
    assert with_recorded_trials(limit, driven(100.0)) is limit
    assert with_recorded_trials(friction, driven(1.0)) is friction
