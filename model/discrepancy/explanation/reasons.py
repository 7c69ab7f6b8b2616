"""Why an effect is named, in one sentence with the numbers of this very case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from daq.contracts.errors import SpecError
from model.discrepancy.diagnosis import Candidate, FoundValue, RemainingShape, SignalError, Step, Where
from model.discrepancy.explanation.numbers import Spoken, from_to, plain
from model.discrepancy.explanation.observations import Observation
from model.discrepancy.explanation.samples import Left, Motions, Samples, motions
from model.discrepancy.explanation.table import telling
from model.discrepancy.localisation.clear_shape import CLEAR_SHAPE, FEWEST_BINS, clear_shape, filled_bins
from model.discrepancy.localisation.dependence import drive_units
from model.discrepancy.localisation.disagreement import spoken_unit
from model.discrepancy.verdict import LEAST_EXCESS
from model.fitting.records import Record, Signal, resolution
from model.machine_model.model import Model

NOTICEABLE = 0.98
"""Share to which an error must fall for the fall to be worth telling."""
ALL = 0.95
"""Share of the evidence from which a rival that far behind has next to none."""
CLEAR = 0.1
"""Share of a disagreement from which an observation is taken before those that come after it in an effect's list."""
GROWN = 1.1
"""Times a joint's mean square error on held-out traces from which a fit has made it worse, beyond what noise may do."""
LEAST_COUNTS = 0.1
"""Counts of a joint's sensor below which a deviation is not told as a number."""


def reason(
    effect: str, joints: Sequence[int], parameters: Mapping[str, FoundValue], evidence: float, margin: float,
    *, model: Model, before: Model, records: Sequence[Record], signal: Signal = "position",
    runner_up: Candidate | None = None, left: Left | None = None, where: Where | None = None,
) -> str:  # fmt: skip
    """What speaks for an effect: the pattern that a record shows without it, its size, and what it takes off.

    The pattern is that of measured − simulated where the simulation has everything but the effect: the numbers of the
    fitted model, with the effect taken out again. So neither the other parameters nor the effect hide it.

    Args:
        parameters: of the effect, by full name. evidence, margin: as in the answer's step.
        model: fitted, with the effect. before: the model without it; a parameter that it has already, such as the
            viscous friction of a machine file, goes back to its value there.
        runner_up: the next best that would be another answer.
        left: measured − simulated of a model, where the caller simulates better than without noise: an arm without
            noise sticks where the real one creeps, so that stiction or a dead zone would hardly show.
        where: the place that the same step names, if any: where it is not the effect's, the reason says so.

    Raises SpecError when a simulation does not stay finite.
    """
    found = motions(model, without_effect(model, before, effect, joints, parameters), records, signal, left)
    own = list(joints) or [model.machine.modelled_joints[_most_affected(found)]]
    joint = max(own, key=lambda j: _gone(found.joint(model.machine.modelled_joints.index(j))))
    index = model.machine.modelled_joints.index(joint)
    samples, say = found.joint(index), _spoken(model, index)
    seen = observed(effect, samples, say, parameters, joint)
    others = [j for j in own if j != joint]
    alike = f" (and likewise joint{'s' if len(others) > 1 else ''} {_listed(others)})" if others else ""
    called = telling(effect).called + _size(effect, parameters, joint)
    rival = "" if runner_up is None else f"; {_beaten(runner_up, evidence, margin)}"
    return (
        f"joint {joint} {seen.text}{alike}: {called}{_taken_off(model, samples, joint)}{rival}{_spread(where, joints)}"
    )


def with_size(
    text: str, effect: str, joints: Sequence[int], before: Mapping[str, FoundValue], after: Mapping[str, FoundValue]
) -> str:
    """A reason that was given with the parameters `before`, with the size that `after` says."""
    joint = next((j for j in joints if text.startswith(f"joint {j} ")), 0)  # 0: an effect of the whole machine
    called = telling(effect).called
    return text.replace(called + _size(effect, before, joint), called + _size(effect, after, joint), 1)


def observed(
    effect: str, samples: Samples, say: Spoken, parameters: Mapping[str, FoundValue], joint: int | None = None
) -> Observation:
    """The first of an effect's observations that is clear in a record, else the clearest."""
    values = _by_last_name(parameters, joint)
    made = [o for observe in telling(effect).observed if (o := observe(samples, say, values)) is not None]
    if not made:
        rms = say.size(float(np.sqrt(np.mean(samples.without**2))))
        return Observation(f"is off by {rms} rms without it", 0.0)
    return next((o for o in made if o.share > CLEAR), max(made, key=lambda o: o.share))


def without_effect(
    model: Model, before: Model, effect: str, joints: Sequence[int], parameters: Mapping[str, FoundValue]
) -> Model:
    """A fitted model with one effect taken out again, everything else as it was fitted."""
    had = {p.name for p in before.parameters}
    back = {n: before.parameter(n).value for n in parameters if n in had and n in model.by_name}
    result = model.with_values(back)
    if back and set(parameters) <= had:
        return result
    try:
        return result.without_effect(effect, tuple(joints) or None)
    except SpecError:
        return result


def nothing(rejected: Step | None = None) -> str:
    """Why no effect is named. `rejected`: a step that held-out traces have spoken against."""
    if rejected is None or rejected.effect is None:
        return "nothing significant: the model explains the traces within noise and stated tolerances"
    return (
        f"nothing that held-out traces confirm: {_named(rejected.effect, rejected.joints)} explains more of the fitted "
        f"ones, with {rejected.evidence:.0f} of evidence, but {rejected.rejected_because}"
    )


def undecided(group: Sequence[Candidate], where: Where) -> str:
    """Why several are named: they explain the same, within what their evidence can tell."""
    if len(group) < 2:
        raise SpecError(f"{len(group)} candidates cannot be undecided between; at least 2 are needed")
    told = ", ".join(f"{_named(c.effect, c.joints)} ({c.evidence:.0f})" for c in group)
    apart = max(c.evidence for c in group) - min(c.evidence for c in group)
    return f"{where.summary}; these explain it, and {apart:.0f} of evidence is all that lies between them: {told}"


def unexplained(
    where: Where, remaining: Sequence[RemainingShape], joints: Sequence[int] = (), best: Candidate | None = None,
    held: Sequence[SignalError] = (),
) -> str:  # fmt: skip
    """Why none of the known effects is named, and what a torque that would explain it goes with.

    Args:
        joints: those that are left unexplained.
        held: errors on held-out traces, from the model as it was given to the one that comes out.
    """
    place = where.summary if where.joint is not None or not joints else _left_on(joints, where)
    tried = "no known effect takes it off"
    if best is not None and best.misfit is not None:
        name = _named(best.effect, best.joints)
        tried = f"the best known one, {name}, leaves {best.misfit:.2f} times what noise would"
    return f"{place}; {tried}; {_shape(remaining)}{_refuted(held)}"


def _refuted(held: Sequence[SignalError]) -> str:
    """A warning where held-out traces speak against the fit of the tolerance parameters."""
    grown = [
        e.joint for e in held if (e.after / e.floor) ** 2 > GROWN * (e.before / e.floor) ** 2 + LEAST_EXCESS
    ]  # fmt: skip
    if not grown:
        return ""
    return (
        "; the fit of the tolerance parameters does not hold on held-out traces, where the error of "
        f"joint{'s' if len(grown) > 1 else ''} {_listed(grown)} grows: the model after is not to be used"
    )


def _shape(remaining: Sequence[RemainingShape]) -> str:
    """What the torque that is left goes with, and whether that is clear enough to invent an effect."""
    if not remaining:
        return "what is left has no shape against time, position, speed, direction or drive"
    clear = clear_shape(remaining)
    told = remaining[0] if clear is None else clear
    torques = [t for t in told.torque if t is not None]
    torque = (
        f"a torque at joint {told.joint} of {plain(min(torques))} to {plain(max(torques))} {told.torque_unit} that "
        f"goes with {told.against}"
    )
    share = f"{100 * told.explained:.0f} % of what is left"
    if clear is not None:
        return f"{torque} explains {share}"
    if told.explained < CLEAR_SHAPE:
        return f"no clear shape: the best, {torque}, explains only {share}"
    few = f"rests on {filled_bins(told)} of the {FEWEST_BINS} bins that a shape needs"
    return f"no clear shape: the best, {torque}, explains {share}, but {few}"


def _left_on(joints: Sequence[int], where: Where) -> str:
    """What is said of joints whose residual is too large, where the map names no joint."""
    named = f"joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}: more than noise is left"
    clearest = max((c for c in where.cells if c.joint in joints), key=lambda c: c.significance, default=None)
    if clearest is None:
        return named
    return (
        f"{named}; the clearest place is joint {clearest.joint} at {clearest.start:.1f} s, "
        f"by {clearest.significance:.1f} standard deviations"
    )


def _gone(samples: Samples) -> float:
    """Sum of squares that the effect takes off, in terms of what is left."""
    left = max(float(np.mean(samples.left**2)), 1e-300)
    return float(np.sum(samples.without**2 - samples.left**2)) / left


def _most_affected(found: Motions) -> int:
    count = found.columns["without"].shape[1]
    return max(range(count), key=lambda j: _gone(found.joint(j)))


def _taken_off(model: Model, samples: Samples, joint: int) -> str:
    factor, unit = spoken_unit(model, joint)
    first, last = (factor * float(np.sqrt(np.mean(r**2))) for r in (samples.without, samples.left))
    if last > NOTICEABLE * first:
        return f", whose mark is faint: the rms error stays near {plain(last)} {unit}"
    told = from_to(first, last)
    return f", which takes its rms error from {told[0]} to {told[1]} {unit}"


def _beaten(rival: Candidate, evidence: float, margin: float) -> str:
    """How far the next best is behind."""
    if margin >= ALL * evidence:
        return f"no other candidate that was fitted has a twentieth of its evidence, {evidence:.0f}"
    name = _named(rival.effect, rival.joints)
    if rival.evidence > evidence:  # it was ranked first, but came to less when its fit was taken to its end
        return (
            f"taken to its end, its fit has {evidence:.0f} of evidence, less than the {rival.evidence:.0f} of {name}: "
            "these traces do not tell which of the two it is"
        )
    return f"the next best, {name}, has {rival.evidence:.0f} of evidence where this has {evidence:.0f}"


def _spread(where: Where | None, joints: Sequence[int]) -> str:
    """What is said where the place that a step names is none, or another joint's."""
    if where is None or (where.joint is not None and (not joints or where.joint in joints)):
        return ""
    return "; what shows it is the pattern over the whole record, not one place"


def _spoken(model: Model, index: int) -> Spoken:
    joint = model.machine.modelled_joints[index]
    own = model.machine.joint(joint)
    turns, velocity = own.kind == "revolute", own.sensor is not None and own.sensor.measures == "velocity"
    place = "°" if turns else "mm"
    return Spoken(
        factor=math.degrees(1.0) if turns else 1e3, unit=f"{place}/s" if velocity else place, place_unit=place,
        drive_unit=drive_units(model)[index], torque_unit="N·m" if turns else "N",
        least=0.0 if own.sensor is None or velocity else LEAST_COUNTS * resolution(own.sensor), turns=turns,
    )  # fmt: skip


def _by_last_name(parameters: Mapping[str, FoundValue], joint: int | None) -> dict[str, float]:
    """Values by the last part of their names; those of one joint where several have them."""
    own = {n: v for n, v in parameters.items() if joint is None or _of_joint(n, joint)}
    return {n.rpartition(".")[2]: v.value for n, v in (own or parameters).items()}


def _of_joint(name: str, joint: int) -> bool:
    first = name.partition(".")[0]
    return first == f"joint{joint}" or (first.startswith("joints") and str(joint) in first[6:].split("+"))


def _size(effect: str, parameters: Mapping[str, FoundValue], joint: int) -> str:
    """“, 0.93° (0.90 to 0.96)”, or nothing where the effect has no single size."""
    name = telling(effect).size
    own = [v for n, v in parameters.items() if n.rpartition(".")[2] == name and _of_joint(n, joint)]
    own = own or [v for n, v in parameters.items() if n.rpartition(".")[2] == name]
    if not own:
        return ""
    value = own[0]
    factor, unit = {"rad": (math.degrees(1.0), "°"), "1": (100.0, " %"), "s": (1e3, " ms"), "H": (1e3, " mH")}.get(
        value.unit, (1.0, f" {value.unit}")
    )
    interval = ""
    if value.low is not None and value.high is not None:
        interval = f" ({plain(value.low * factor, 3)} to {plain(value.high * factor, 3)})"
    return f", {plain(value.value * factor, 3)}{unit}{interval}"


def _named(effect: str, joints: Sequence[int]) -> str:
    on = f" on joint{'s' if len(joints) > 1 else ''} {_listed(joints)}" if joints else ""
    return f"{telling(effect).called}{on}"


def _listed(joints: Sequence[int]) -> str:
    names = [str(j) for j in joints]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
