"""Response of readings to small changes of set points: one band of a lifted system for each joint.

A change d(i) of the set point of period i changes the reading of period i + m by h(i, m) d(i). The response differs
from period to period, because it depends on posture, friction and saturation; it has decayed after `REACH`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import Floats

REACH = 50
"""Periods after which a change of a set point no longer shows: 1 s, five times the slowest decay of the default
loop."""


@dataclass(frozen=True)
class Response:
    """The response of one joint over k periods: `band` (k, m); entries beyond the end of the record are zero."""

    band: Floats

    def applied(self, change: Floats) -> Floats:
        """Returns the change of the readings (k,) for changes (k,) of the set points."""
        count, reach = self.band.shape
        found = np.zeros(count)
        for m in range(min(reach, count)):
            found[m:] += self.band[: count - m, m] * change[: count - m]
        return found

    def transposed(self, readings: Floats) -> Floats:
        """Returns Σ over m of h(i, m) times reading i + m, for each i: (k,)."""
        reach = self.band.shape[1]
        padded = np.concatenate([readings, np.zeros(reach - 1)])
        return np.asarray((self.band * np.lib.stride_tricks.sliding_window_view(padded, reach)).sum(axis=1))

    def normal(self) -> Floats:
        """Returns the lower band (m, k) of the matrix of the normal equations: row d holds the elements (i + d, i)."""
        count, reach = self.band.shape
        found = np.zeros((reach, count))
        for d in range(min(reach, count)):
            found[d, : count - d] = (self.band[: count - d, d:] * self.band[d:, : reach - d]).sum(axis=1)
        return found


def response_of(band: Floats) -> Response:
    """Returns a response from its band (k, m), without entries beyond the end of the record."""
    count, reach = band.shape
    inside = np.arange(count)[:, None] + np.arange(reach) < count
    return Response(np.where(inside, band, 0.0))
