"""What may be missing: every effect of the library on every joint, as a model with free parameters and trial sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from model import layout as at
from model.effects.library import effect, library
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

TONES = ("torque_ripple", "periodic_disturbance")
"""Effects with a frequency, which trial sizes cannot find: a spectrum proposes it."""
FLEXIBLE = ("backlash", "joint_compliance")
"""Effects that cost five times the simulation: tried only on joints where something is wrong."""
TRIALS: Mapping[str, tuple[float, ...]] = {
    "backlash": (0.15, 0.5, 1.5),
    "joint_compliance": (0.15, 0.5, 1.5),
    "dead_zone": (0.1, 0.4, 1.5),
    "supply_limit": (0.3, 0.8, 1.3),
    "input_delay": (0.1, 0.4, 1.2, 2.5),
    "motor_inductance": (0.6, 2.0, 8.0),
    "stiction": (0.5, 2.0, 6.0),
    "stribeck_friction": (0.4, 1.5, 5.0),
    "lost_set_points": (0.1, 0.5, 1.5),
    "direction_dependent_friction": (0.3, 2.0),
}
"""Trial sizes in expected deviations of effects that do not grow in proportion to their parameter."""
FREED_BENDS = ("bend_1", "bend_2", "bend_3", "bend_4")
"""Terms of a bent potentiometer that a candidate frees from their priors; shorter waves stay what a sound one has."""
SMALL = 0.002
"""Expected deviations: the one trial of all others, which tells the size by itself. It is small: an effect that does
what a tolerance parameter does can only be told by the price of that parameter's prior, and a curved response would
hide it."""
STICTION_SPEED = 0.045
"""rad/s: friction that has fallen below this speed belongs to breaking away, above it to the Stribeck curve. At 20 ms
and 12 bits the joint moves by less than a count a sample there: no reading shows the fall."""
STICTION_SHAPE, STRIBECK_SHAPES = 0.025, (0.09, 0.25)
"""rad/s over which friction falls, in trials."""


@dataclass(frozen=True)
class Candidate:
    """One effect at one place.

    Args:
        name: of the effect, as answered. joints: where; none for the whole machine.
        model: with the effect in it, where it does nothing. free: parameters that it lets move without a prior.
        trials: values by full name, one set a trial.
        proportional: whether its response grows with its size, so that one trial tells the size.
        bounds: narrower than the parameter's own, by full name.
    """

    name: str
    joints: tuple[int, ...]
    model: Model
    free: tuple[Parameter, ...]
    trials: tuple[dict[str, float], ...]
    proportional: bool
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def main(self) -> tuple[Parameter, ...]:
        """The free parameters that have a value at which the effect is absent."""
        return tuple(p for p in self.free if p.null is not None)


def candidates(
    model: Model, effects: Sequence[str] | None = None, joints: Sequence[int] | None = None
) -> tuple[Candidate, ...]:
    """Every effect that the model could get, except those found by a spectrum. Raises SpecError for unknown names, and
    for joints that are not modelled.

    Args:
        effects: names; None for the whole library. joints: only on these; None for all.
    """
    names = tuple(library()) if effects is None else tuple(effect(name).name for name in effects)
    found: list[Candidate] = []
    for name in names:
        if name in TONES:
            continue
        places = ((),) if effect(name).whole_machine else tuple((j,) for j in joints or model.machine.modelled_joints)
        for place in places:
            found.extend(_variants(model, name, place))
    return tuple(found)


def tone(model: Model, name: str, joint: int, values: Mapping[str, float]) -> Candidate | None:
    """A candidate whose frequency a spectrum has proposed; `values` by the last part of the name."""
    return _candidate(model, name, name, (joint,), (dict(values),), proportional=False)


def on_joints(model: Model, alike: Sequence[Candidate], values: Mapping[str, float]) -> Candidate | None:
    """One law on all the joints of candidates for single ones, with one trial: `values` by full name. None where the
    model has the effect on some of the joints already."""
    first = alike[0]
    joints = tuple(sorted(j for c in alike for j in c.joints))
    bounds = {name: own for c in alike for name, own in c.bounds.items()}
    law = first.free[0].effect or first.name
    found = _candidate(model, first.name, law, joints, (dict(values),), proportional=False, bounds=bounds)
    return found if found is not None and {j for p in found.free for j in p.joints} >= set(joints) else None


def _variants(model: Model, name: str, joints: tuple[int, ...]) -> list[Candidate]:
    found: list[Candidate | None] = []
    if name == "stribeck_friction":
        shapes = tuple({"speed": s} for s in STRIBECK_SHAPES)
        found.append(_sized(model, name, name, joints, shapes, {"speed": (STICTION_SPEED, 10.0)}))
    elif name == "stiction":
        shapes = ({"speed": STICTION_SHAPE},)
        found.append(_sized(model, name, "stribeck_friction", joints, shapes, {"speed": (0.004, STICTION_SPEED)}))
        found.append(_sized(model, name, name, joints, ({},), {}))
    elif name == "resistance_drift":
        found.append(_sized(model, name, name, joints, ({"time_constant": 10.0}, {"time_constant": 30.0}), {}))
    elif name == "spring_torque":
        rest = model.machine.rest_posture
        found.append(_sized(model, name, name, joints, ({"rest": 0.0 if rest is None else rest[joints[0] - 1]},), {}))
    else:
        found.append(_sized(model, name, name, joints, ({},), {}))
    return [c for c in found if c is not None]


def _sized(
    model: Model, name: str, law: str, joints: tuple[int, ...], shapes: Sequence[dict[str, float]],
    bounds: dict[str, tuple[float, float]],
) -> Candidate | None:  # fmt: skip
    """A candidate with trials of every main parameter, in either direction that its bounds allow, for every shape."""
    plain = _candidate(model, name, law, joints, ({},), proportional=law not in TRIALS, bounds=bounds)
    if plain is None:
        return None
    trials = []
    for p in plain.main:
        size = p.deviation or 1.0
        steps = [(SMALL,)] if plain.proportional else [(m, -m) for m in TRIALS[law]]
        for step in (s for pair in steps for s in pair):
            value = (p.null if p.effect == "motor_inductance" and p.null is not None else p.value) + step * size
            if not p.low <= value <= p.high and plain.proportional:
                value = p.value - step * size
            if p.low <= value <= p.high:
                trials += [{p.name: value, **_full(plain.free, shape)} for shape in shapes]
    return replace(plain, trials=tuple(trials))


def _candidate(
    model: Model, name: str, law: str, joints: tuple[int, ...], trials: tuple[dict[str, float], ...],
    proportional: bool, bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Candidate | None:  # fmt: skip
    """The model with the effect, or, where it has it already with a prior, with that prior lifted."""
    present = [u for u in model.effects if u.name == law and (not joints or set(joints) & set(u.joints))]
    if present:
        if law in TONES or law == "stribeck_friction":
            return None
        wider = model
        free = tuple(p for p in model.parameters if p.effect == law and (not joints or set(joints) & set(p.joints)))
        free = tuple(p for p in free if p.null is not None)
    else:
        if not _has_place(model, law, joints):
            return None
        wider = model.with_effect(law, joints)
        free = tuple(p for p in wider.parameters if p.name not in model.by_name)
    if law == "potentiometer_nonlinearity":
        free = tuple(p for p in free if p.name.endswith(FREED_BENDS))
    full = tuple(_full(free, trial) for trial in trials)
    return Candidate(name, joints, wider, free, full, proportional, _full_bounds(free, bounds or {}))


def _has_place(model: Model, law: str, joints: tuple[int, ...]) -> bool:
    """Whether the model can have the effect there: one of the user's own acts on the joints of its file alone, and a
    model has only so much room for those."""
    kind = effect(law)
    own = {use.name for use in model.effects if use.file is not None} | ({law} if kind.file is not None else set())
    taken = sum(len(effect(name).parameters) for name in own)
    return taken <= at.USER_COLUMNS and (not kind.joints or set(joints) <= set(kind.joints))


def _full(free: Sequence[Parameter], values: Mapping[str, float]) -> dict[str, float]:
    """Values by full name, from full names or last parts of them."""
    return {p.name: values[key] for p in free for key in values if key in (p.name, p.name.rpartition(".")[2])}


def _full_bounds(
    free: Sequence[Parameter], bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    return {p.name: bounds[key] for p in free for key in bounds if key in (p.name, p.name.rpartition(".")[2])}
