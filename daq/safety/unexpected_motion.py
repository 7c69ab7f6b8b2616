"""A joint that should stand still must stand still."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Verdict, Watched

STILL_WITHIN = 40
"""ADC counts that a joint at rest may stray: an assumption. Gravity and the motion of other joints deflect the arm by a
few counts at the default gain; 40 are 2.6° on the major axes."""


@dataclass
class UnexpectedMotion:
    """Judges the joints of `still`; the others are the following error's business.

    While nothing runs the reference is where each joint was first seen; while a plan runs, its set point.
    """

    watched: Watched
    still: frozenset[int]
    from_set_point: bool
    seen: dict[int, float] = field(default_factory=dict)

    def check(self, row: SampleRow) -> Verdict:
        """The verdict after a sample."""
        trips = []
        for joint, counts in self._strayed(row).items():
            if abs(counts) > STILL_WITHIN:
                what = "its set point" if self.from_set_point else "where it was"
                strayed = f"unexpected motion, {counts:.0f} ADC counts from {what}"
                trips.append(f"joint {joint}: {strayed}, allowed are ±{STILL_WITHIN}")
        return Verdict(trips=tuple(trips)) if trips else NOTHING

    def _strayed(self, row: SampleRow) -> Mapping[int, float]:
        if self.from_set_point:
            away = tuple(-error for error in row.error)
        else:
            for joint, position in zip(self.watched.joints, row.position, strict=True):
                self.seen.setdefault(joint, position)
            away = tuple(p - self.seen[j] for j, p in zip(self.watched.joints, row.position, strict=True))
        counts = zip(self.watched.joints, self.watched.counts(away), strict=True)
        return {joint: strayed for joint, strayed in counts if joint in self.still}
