"""Trial sizes that follow from the recorded drive."""

from dataclasses import replace

import numpy as np

from model.discrepancy.candidates.library import SHARES, hypotheses, with_recorded_trials
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


def test_a_cable_becomes_taut_where_the_joint_has_been() -> None:
    (cable,) = hypotheses(imagined.arm(), ("one_sided_spring",), (2,))
    observation = driven(3.0)
    tried = with_recorded_trials(cable, observation)
    positions = np.concatenate([r.inputs.readings[:, 1] for r in observation.records])
    name = "joint2.one_sided_spring.rest"
    low, high = tried.bounds[name]
    assert np.nanmin(positions) <= low < high <= np.nanmax(positions)
    assert all(low <= trial[name] <= high for trial in tried.trials)
    stiffness = {np.sign(trial["joint2.one_sided_spring.stiffness"]) for trial in tried.trials}
    assert stiffness == {-1.0, 1.0}, "on either side"


def test_trials_that_the_record_reaches_stay_as_they_are() -> None:
    (limit,) = hypotheses(imagined.arm(), ("supply_limit",), (2,))
    (friction,) = hypotheses(imagined.arm(), ("dead_zone",), (2,))
    assert with_recorded_trials(limit, driven(100.0)) is limit
    assert with_recorded_trials(friction, driven(1.0)) is friction
