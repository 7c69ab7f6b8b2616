"""Cuts a record at its gaps, for methods that need only a short motion at a time: a balance of torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from daq.contracts.trace import Trace
from model.record_check.readings import find_gaps, is_bridged

SHORTEST = 8.0
"""Shortest duration of a piece, s: it is enough for torques below 1 Hz, the lowest cutoff that is chosen."""


def in_pieces(traces: Sequence[Trace]) -> list[Trace]:
    """Returns the traces, each cut at every gap that is too long to interpolate.

    Pieces keep the identity of their trace. Those shorter than `SHORTEST` are left out. If all are, the whole trace
    stays, so that its user rejects it.
    """
    return [piece for trace in traces for piece in _pieces(trace)]


def _pieces(trace: Trace) -> list[Trace]:
    if len(trace) < 2:
        return [trace]
    usual = float(np.median(np.diff(trace.time)))
    cuts = [row + 1 for row, length in find_gaps(trace.time) if not is_bridged(length, usual)]
    if not cuts:
        return [trace]
    spans = [slice(a, b) for a, b in pairwise([0, *cuts, len(trace)]) if trace.time[b - 1] - trace.time[a] >= SHORTEST]
    return [_part(trace, span) for span in spans] or [trace]


def _part(trace: Trace, span: slice) -> Trace:
    signals = {f.name: getattr(trace, f.name) for f in fields(trace)}
    rows: dict[str, Any] = {name: own[span] for name, own in signals.items() if isinstance(own, np.ndarray)}
    return replace(trace, **rows)
