"""Candidates that no motion tells apart, answered as one class: what they share, and which measurement would tell them.

That they are inseparable is measured: neither a preset nor any motion of a search sets them apart. What they share is
looked up in a table of laws; candidates that no law of it has in common are still one class, without a name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from model.discrepancy.diagnosis import Inseparable, PlacedEffect
from model.discrepancy.experiment_design.separation import LEAST, Pair
from model.discrepancy.explanation.effect_words import LAWS, MEASUREMENTS
from model.discrepancy.grounds import Measurement, Note, SharedLaw
from model.effects.names import effect_on


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
        if effects <= set(law.effects) and len(effects) > 1 and (not law.one_joint or len(places) == 1):
            return name
    return None


def measurements(law: SharedLaw, members: Sequence[PlacedEffect]) -> tuple[Measurement, ...]:
    """The measurements that tell these effects, which have a law in common."""
    effects = {m.effect for m in members}
    return tuple(m for m in LAWS[law].told_by if effects & set(MEASUREMENTS[m].shows))


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
