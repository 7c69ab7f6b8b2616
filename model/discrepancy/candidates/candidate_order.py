"""The order in which candidates are shown: what fits have shown first, what probes only promise after it."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import Candidate


def in_order(candidates: Sequence[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
    """The fitted candidates and those that were only probed, each by evidence, the best first.

    The two are not comparable: a fit shows what a candidate takes off, a probe extrapolates what it might.
    """
    best_first = sorted(candidates, key=lambda c: -c.evidence)
    return [c for c in best_first if c.refitted], [c for c in best_first if not c.refitted]
