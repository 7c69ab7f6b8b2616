"""Why an effect is named, in one sentence with the numbers of this very case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from daq.contracts.errors import SpecError
from model.discrepancy.answer import Candidate, FoundValue, RemainingShape, Step, Where
from model.discrepancy.reasons_observations import Observation, Spoken
from model.discrepancy.reasons_samples import Left, Motions, Samples, motions
from model.discrepancy.reasons_table import telling
from model.discrepancy.where import spoken_unit
from model.discrepancy.where_dependence import drive_units
from model.fitting.records import Record, Signal
from model.machine_model.model import Model

NOTICEABLE = 0.98
"""Share to which an error must fall for the fall to be worth telling."""
ALL = 0.95
"""Share of the evidence from which a rival that far behind has next to none."""
CLEAR = 0.1
"""Share of a disagreement from which an observation is taken before those that come after it in an effect's list."""


def reason(
    effect: str, joints: Sequence[int], parameters: Mapping[str, FoundValue], evidence: float, margin: float,
    *, model: Model, before: Model, records: Sequence[Record], signal: Signal = "position",
    runner_up: Candidate | None = None, left: Left | None = None,
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
    return f"joint {joint} {seen.text}{alike}: {called}{_taken_off(model, samples, joint)}{rival}"


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
    where: Where, remaining: Sequence[RemainingShape], joints: Sequence[int] = (), best: Candidate | None = None
) -> str:
    """Why none of the known effects is named, and what a torque that would explain it goes with. joints: those that are
    left unexplained."""
    place = where.summary if where.joint is not None or not joints else _left_on(joints, where)
    tried = "no known effect takes it off"
    if best is not None and best.misfit is not None:
        name = _named(best.effect, best.joints)
        tried = f"the best known one, {name}, leaves {best.misfit:.2f} times what noise would"
    if not remaining:
        return f"{place}; {tried}, and what is left goes with none of time, position, speed, direction or drive"
    first = remaining[0]
    torques = [t for t in first.torque if t is not None]
    return (
        f"{place}; {tried}; a torque at joint {first.joint} of {min(torques):.2g} to {max(torques):.2g} "
        f"{first.torque_unit} that goes with {first.against} explains {100 * first.explained:.0f} % of what is left"
    )


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
        return f", whose mark is faint: the rms error stays near {last:.2g} {unit}"
    return f", which takes its rms error from {first:.2g} to {last:.2g} {unit}"


def _beaten(rival: Candidate, evidence: float, margin: float) -> str:
    """How far the next best is behind."""
    if margin >= ALL * evidence:
        return "no other candidate explains a twentieth of it"
    return f"{_named(rival.effect, rival.joints)} would explain {margin:.0f} less of {evidence:.0f}"


def _spoken(model: Model, index: int) -> Spoken:
    joint = model.machine.modelled_joints[index]
    own = model.machine.joint(joint)
    turns = own.kind == "revolute"
    speed = "/s" if own.sensor is not None and own.sensor.measures == "velocity" else ""
    return Spoken(
        math.degrees(1.0) if turns else 1e3, f"°{speed}" if turns else f"mm{speed}", drive_units(model)[index],
        "N·m" if turns else "N",
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
        interval = f" ({value.low * factor:.3g} to {value.high * factor:.3g})"
    return f", {value.value * factor:.3g}{unit}{interval}"


def _named(effect: str, joints: Sequence[int]) -> str:
    on = f" on joint{'s' if len(joints) > 1 else ''} {_listed(joints)}" if joints else ""
    return f"{telling(effect).called}{on}"


def _listed(joints: Sequence[int]) -> str:
    names = [str(j) for j in joints]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
