"""The 1991 thesis, reproduced."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.progress import Cancel
from daq.contracts.trace import Trace
from extras.thesis import reproduction
from extras.thesis.ladder import Method
from extras.thesis.reproduction import Reproduction
from ma2000.progress import Shown, told


def reproduce_thesis(
    traces: Sequence[Trace],
    methods: Sequence[Method] = ("least_squares",),
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Reproduction:
    """Repeats chapters 5, 7 and 8 of the 1991 thesis, with each value beside the published one (docs/thesis.md).

    Args:
        traces: of the ramp of section 6.5, which is the preset `ramp`.
        methods: of fitting; `nelder_mead` is that of the thesis, and takes minutes.

    Raises TraceError for traces that cannot be simulated, SpecError; CancelledError when cancelled.
    """
    with told(progress, "reproducing") as tell:
        return reproduction.reproduce_thesis(traces, methods, progress=tell, cancel=cancel)
