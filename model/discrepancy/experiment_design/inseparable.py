"""Candidates that no motion tells apart, answered as one class: what they share, and which measurement would tell them.

That they are inseparable is measured: neither a preset nor any motion of a search sets them apart. What they share is
looked up in a table of laws; candidates that no law of it has in common are still one class, without a name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from model.discrepancy.diagnosis import Inseparable, PlacedEffect
from model.discrepancy.experiment_design.separation import LEAST, Pair
from model.discrepancy.grounds import Measurement, Note, SharedLaw
from model.effects.names import effect_on


@dataclass(frozen=True)
class _Law:
    """A law that effects have in common. one_joint: only effects on the same joint do."""

    effects: frozenset[str]
    told_by: tuple[Measurement, ...]
    one_joint: bool = True


_FRICTION = frozenset(
    {
        "coulomb_friction",
        "load_dependent_friction",
        "gravity_torque_friction",
        "direction_dependent_friction",
        "stribeck_friction",
        "stiction",
        "gear_loss",
        "direction_dependent_gear_loss",
    }
)
_READING = frozenset({"potentiometer_gain", "potentiometer_offset", "potentiometer_nonlinearity"})
_WEIGHT = frozenset({"payload", "link_mass", "centre_of_mass"})

LAWS: Mapping[SharedLaw, _Law] = {
    # n² K_T K_b/R and B act on the speed alone; only the first needs a current in the winding.
    "torque-with-speed": _Law(
        frozenset({"viscous_friction", "direction_dependent_viscous_friction", "weakened_magnet"}),
        ("current-clamp", "coast-with-drive-open"),
    ),
    "late-drive": _Law(frozenset({"input_delay", "motor_inductance"}), ("oscilloscope",)),
    "play-and-give": _Law(frozenset({"backlash", "joint_compliance"}), ("dial-gauge",)),
    "reading-over-range": _Law(_READING, ("protractor",)),
    # The moment of all weights beyond a joint is one number per link: mass times distance.
    "torque-of-weight": _Law(_WEIGHT, ("weighed-parts",), one_joint=False),
    # A sliding joint's dry friction at one load; a dead zone takes its width off the drive in the same direction.
    "torque-against-motion": _Law(_FRICTION | {"dead_zone", "amplifier_threshold"}, ("force-gauge", "current-clamp")),
    "torque-per-volt": _Law(
        frozenset(
            {
                "weakened_magnet",
                "resistance_drift",
                "resistance_rise",
                "gear_loss",
                "direction_dependent_gear_loss",
                "wrong_gain",
                "supply_limit",
            }
        ),
        ("current-clamp", "force-gauge"),
    ),
    "torque-at-one-rate": _Law(frozenset({"torque_ripple", "periodic_disturbance"}), ("stopped-arm",)),
    "torque-with-position": _Law(
        _WEIGHT | _READING | {"spring_torque", "one_sided_spring", "base_tilt"},
        ("loosened-cables", "spirit-level", "protractor", "weighed-parts"),
        one_joint=False,
    ),
}
"""Laws and the effects that have them, the narrowest first."""
SHOWS: Mapping[Measurement, frozenset[str]] = {
    # The current is (u − K_b n q̇)/R as the model has it, unless something electrical is another.
    "current-clamp": frozenset(
        {
            "weakened_magnet",
            "resistance_drift",
            "resistance_rise",
            "wrong_gain",
            "supply_limit",
            "dead_zone",
            "amplifier_threshold",
        }
    ),
    # Without a current, friction alone slows the joint.
    "coast-with-drive-open": frozenset({"viscous_friction", "direction_dependent_viscous_friction"}),
    "force-gauge": _FRICTION,
    "weighed-parts": _WEIGHT,
    "spirit-level": frozenset({"base_tilt"}),
    "loosened-cables": frozenset({"spring_torque", "one_sided_spring"}),
    "protractor": _READING,
    "dial-gauge": frozenset({"backlash", "joint_compliance"}),
    "oscilloscope": frozenset({"motor_inductance", "input_delay"}),
    # A disturbance from outside does not wait for the joint to turn.
    "stopped-arm": frozenset({"periodic_disturbance"}),
}
"""Effects that a measurement shows by themselves: it is of use for a class with one of them."""


def classes_of(
    rivals: Sequence[PlacedEffect], hopeless: Mapping[Pair, tuple[float, str]], tried: int
) -> tuple[Inseparable, ...]:
    """Classes of rivals of which no two are told apart.

    Args:
        hopeless: pairs that nothing told apart, with the largest separation and the experiment that gives it.
        tried: experiments judged.
    """
    found = []
    for group in _cliques(hopeless):
        members = tuple(rivals[k] for k in group)
        separation, experiment = max(hopeless[p] for p in hopeless if set(p) <= set(group))
        shares = shared_law(members)
        found.append(
            Inseparable(
                members=members,
                separation=separation,
                needed=LEAST,
                experiment=experiment,
                tried=tried,
                shares=shares,
                told_by=() if shares is None else measurements(shares, members),
            )
        )
    return tuple(found)


def shared_law(members: Sequence[PlacedEffect]) -> SharedLaw | None:
    """The narrowest law of the table that all these effects have in common; None where there is none."""
    effects, places = {m.effect for m in members}, {m.joints for m in members}
    for name, law in LAWS.items():
        if effects <= law.effects and len(effects) > 1 and (not law.one_joint or len(places) == 1):
            return name
    return None


def measurements(law: SharedLaw, members: Sequence[PlacedEffect]) -> tuple[Measurement, ...]:
    """The measurements that tell these effects, which have a law in common."""
    effects = {m.effect for m in members}
    return tuple(m for m in LAWS[law].told_by if SHOWS[m] & effects)


def notes_on(classes: Sequence[Inseparable], budget: float | None) -> tuple[Note, ...]:
    """Notes on classes: one for each that has a name, and one for all pairs of the others. budget: s of robot time."""
    named = tuple(
        Note(kind="one-class", values=c.model_dump(mode="json") | {"budget": budget})
        for c in classes
        if c.shares is not None
    )
    pairs = [
        [*(effect_on(m.effect, m.joints) for m in pair), c.separation]
        for c in classes
        if c.shares is None
        for pair in combinations(c.members, 2)
    ]
    if not pairs:
        return named
    return (*named, Note(kind="not-separable", values={"pairs": pairs, "least": LEAST, "budget": budget}))


def _cliques(pairs: Mapping[Pair, object]) -> list[tuple[int, ...]]:
    """Groups, as large as may be, of which every two are one of the pairs."""
    found: list[set[int]] = []
    for pair in pairs:
        if any(set(pair) <= group for group in found):
            continue
        group = set(pair)
        for other in sorted({k for p in pairs for k in p}):
            if all((min(k, other), max(k, other)) in pairs for k in group if k != other):
                group.add(other)
        found.append(group)
    return [tuple(sorted(group)) for group in found]
