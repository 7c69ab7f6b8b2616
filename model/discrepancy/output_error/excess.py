"""How much of what noise cannot explain is gone: a share of variance above its floor."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import SignalError

LEAST_EXCESS = 0.25
"""Variance of a joint above its floor, in floors, of which a share means anything: 17 s tell it to 0.06."""
GROWN = 1.1
"""Ratio of a joint's mean square errors on held-out traces, above which a fit has made them worse beyond noise."""


def excess_removed(found: Sequence[SignalError]) -> float | None:
    """Share of the variance above the floor that is gone, over the joints that showed enough of it, each in its floors.

    None where no joint did: a share of what noise may have made says nothing.
    """
    ratios = [((e.before / e.floor) ** 2 - 1.0, (e.after / e.floor) ** 2 - 1.0) for e in found]
    shown = [(before, after) for before, after in ratios if before >= LEAST_EXCESS]
    return 1.0 - sum(after for _, after in shown) / sum(before for before, _ in shown) if shown else None


def worse_held_out(held: Sequence[SignalError]) -> tuple[int, ...]:
    """Joints whose error on held-out traces has grown beyond what noise may do."""
    return tuple(e.joint for e in held if (e.after / e.floor) ** 2 > GROWN * (e.before / e.floor) ** 2 + LEAST_EXCESS)
