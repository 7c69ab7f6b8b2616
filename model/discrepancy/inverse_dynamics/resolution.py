"""Whether a record resolves what a fitted effect claims: what a sound rig imitates (decision 0053)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import Fit, found_values
from model.discrepancy.engine.lifted import BENT, LIMIT, ends_at_bound, is_far_everywhere
from model.discrepancy.engine.search import cost_of
from model.discrepancy.excitation import own_frequencies
from model.discrepancy.inverse_dynamics.residual import TorqueResidual
from model.discrepancy.localisation.structure import CLIP
from model.discrepancy.options import TorqueOptions
from model.discrepancy.thresholds import LARGER_PART
from model.inverse_dynamics.drive_timing import DELAY, MOST
from model.inverse_dynamics.recorded_motion import RecordedMotion, holds_drive_between_samples
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

OF_CHANGES = frozenset({"joint_compliance", "backlash", "input_delay", "motor_inductance"})
"""Effects whose torque follows how a torque changes in time: they cut short or shift what is fast, and noise of
accelerations, or a gear that rattles, is fast."""
REPEATING = "periodic_disturbance"
"""The effect of a torque that repeats in time."""
MOST_UNEVEN = 0.6
"""Largest change of a bent sensor's scale over its range, as a share: a potentiometer that is loaded with twice its own
resistance comes to 0.5. Rigs whose friction had a tight spot, and gears that gave, were told as sensors of which the
reading went backwards."""
SLOWER = 0.5
"""Share of the cutoff at which such an effect has to show as well. The variance of an acceleration's noise grows with
the fifth power of the cutoff, so 3 % of it is left there."""
PLACES = 101
"""Places of a sensor's range at which its scale is looked at."""
LIMITED = 0.01
"""Least share of the record, rests included, in which the drive is above a limit that is named. Hidden limits were
exceeded in 1.6 % of the samples or more. On sound arms, spikes in 0.3 % of the samples were told as a limit 4 % below
their highest (decision 0053)."""
AT_BOUND = 1.01
"""Ratio to a bound within which a shape is at it."""
UNRESOLVED_ENDS = {("stribeck_friction", "speed"): "low"}
"""Ends of a shape that may lie beyond what records resolve: where friction fades below the lowest speed that is looked
at, a smoothed speed does not tell whether the joint stands."""
IMPOSSIBLE_ENDS = {("stribeck_friction", "speed"): "high", ("resistance_rise", "time_constant"): "low"}
"""Ends of a shape that are another effect: no record shows that friction fades at the highest speed, and Coulomb
friction is the simpler law; no copper is as warm as it gets at once, and what is more at once than before is friction
or a lost part of the drive."""


def is_resolved(
    found: Fitted, before: Fit, records: Sequence[RecordedMotion], noise: Floats, options: TorqueOptions
) -> bool:
    """Whether the records can tell this effect from a sound rig.

    Args:
        before: the fit without the effect. noise: (n,) standard deviation of a residual of which only noise is left.
    """
    if _is_of_no_machine(found, records) or _repeats_with_motion(found, records):
        return False
    plain = _takes_half_of_what_is_no_noise(found, before, noise)
    if not plain and _ends(found, UNRESOLVED_ENDS):
        return False
    if sizes_at_bounds(found) or not is_far_everywhere(found.stated, found.fit.values):
        return False
    if found.effect not in OF_CHANGES or plain:
        return True
    return slower_evidence(found, before, records) >= options.least_evidence


def _is_of_no_machine(found: Fitted, records: Sequence[RecordedMotion]) -> bool:
    """Whether an effect as it was fitted is how drives are formed, or what no machine does in the recorded motion."""
    if found.effect == DELAY and _may_be_timing(found, records):
        return True
    return _ends(found, IMPOSSIBLE_ENDS) or _is_uneven(found) or _is_hardly_reached(found, records)


def _ends(found: Fitted, ends: Mapping[tuple[str, str], str]) -> bool:
    """Whether a shape of an effect ended at one of these ends of its range."""
    for p in found.parameters:
        end, value = ends.get((p.effect or "", p.part)), found.fit.values[p.name]
        if (end == "low" and value <= AT_BOUND * p.low) or (end == "high" and AT_BOUND * value >= p.high):
            return True
    return False


def _takes_half_of_what_is_no_noise(found: Fitted, before: Fit, noise: Floats) -> bool:
    """Whether on every joint of an effect five times the noise is left without it, and half of that with it: no noise
    imitates that, however fast it is."""
    own = np.array([j in found.joints for j in found.model.machine.modelled_joints])
    first, last = (fit.squares[own] for fit in (before, found.fit))
    return bool(own.any() and (first > (CLIP * noise[own]) ** 2).all() and (last < LARGER_PART * first).all())


def slower_evidence(found: Fitted, before: Fit, records: Sequence[RecordedMotion]) -> float:
    """Evidence of an effect, as it was fitted, in torques low-passed at a share `SLOWER` of the cutoff."""
    samples, floor = found.fit.compared.samples, found.fit.compared.floor * SLOWER**2.5
    slower = tuple(record.slower(SLOWER) for record in records)
    both = [TorqueResidual(TorqueBalance(fit.model, slower), samples, floor) for fit in (before, found.fit)]
    rows = [samples.flat(one.at(fit.values)) for one, fit in zip(both, (before, found.fit), strict=True)]
    (first, last), memory = both[0].descriptions(rows)
    return float((first - last).sum()) - cost_of(before, memory, len(found.parameters), 1)


def _is_uneven(found: Fitted) -> bool:
    """Whether a bent sensor's reading would be more uneven than any sensor's is, somewhere in its range."""
    if found.effect != BENT:
        return False
    model = found.model.with_values(found.fit.model_values)
    return any(steepest_bend(model, joint) > MOST_UNEVEN for joint in found.joints)


def _is_hardly_reached(found: Fitted, records: Sequence[RecordedMotion]) -> bool:
    """Whether this is a limit above which the drive hardly ever is."""
    if found.effect != LIMIT:
        return False
    for p in found.parameters:
        drives = np.concatenate([np.abs(r.commanded[:, p.joints[0] - 1]) for r in records])
        if np.mean(drives > found.fit.values[p.name]) < LIMITED:
            return True
    return False


def steepest_bend(model: Model, joint: int) -> float:
    """Largest change of the scale of a joint's bent sensor over its range, as a share; 0 without a sensor."""
    sensor = model.machine.joint(joint).sensor
    if sensor is None:
        return 0.0
    place = np.linspace(0.0, 1.0, PLACES)
    waves = [(k * np.pi, model.vector[at.slot(joint, column)]) for k, column in enumerate(at.BENDS, start=1)]
    slope = sum(bend * rate * np.cos(rate * place) for rate, bend in waves)
    return float(np.abs(slope).max()) / sensor.range.value


def _may_be_timing(found: Fitted, records: Sequence[RecordedMotion]) -> bool:
    """Whether this delay may be how the drive is formed and held: on some joint the lower end of its interval is not
    beyond what such a drive may be late by."""
    if holds_drive_between_samples(found.model.machine):
        return False
    most = MOST * max(record.sampled for record in records)
    estimates = found_values(found.fit, found.parameters).values()
    return any(e.low is None or e.low <= most for e in estimates)


def _repeats_with_motion(found: Fitted, records: Sequence[RecordedMotion]) -> bool:
    """Whether a disturbance repeats as often as the motion itself: then it goes with the motion, as every torque that
    is a little wrong does."""
    if found.effect != REPEATING:
        return False
    rates = [found.fit.values[p.name] for p in found.parameters if p.part == "frequency"]
    speeds = [record.speed for record in records]
    return bool(own_frequencies(np.array(rates), speeds, records[0].period).any())


def sizes_at_bounds(found: Fitted) -> list[Parameter]:
    """Sizes of an effect that ended at the end of what they may be."""
    return [p for p in found.parameters if ends_at_bound(p, found.fit.values[p.name])]
