"""Cases of the closed loop for tests, as far as the first fit and the first search."""

from collections.abc import Sequence

from daq.contracts.progress import Never
from daq.contracts.trace import Trace
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.probing import Probe, projection
from model.discrepancy.engine.search import Findings, search
from model.discrepancy.options import DiagnosisOptions, reading_options
from model.discrepancy.readings.case import ReadingCase, reading_case
from model.machine_model.model import Model


def case_of(
    model: Model,
    traces: Sequence[Trace],
    held_out: Sequence[Trace] = (),
    effects: tuple[str, ...] | None = None,
    joints: tuple[int, ...] | None = None,
) -> ReadingCase:
    """The case of traces."""
    options = reading_options(DiagnosisOptions(effects=effects, joints=joints))
    return reading_case(model, traces, held_out, options, (), None)


def fitted(case: ReadingCase) -> Fit:
    """The given model, with its numbers fitted."""
    return case.first(case.unknowns(case.given, {}))


def probes(case: ReadingCase, now: Fit) -> list[Probe]:
    """All trials at their best starts, in their order."""
    clear = projection(now.with_slopes())
    found: list[Probe] = []
    for trial in case.trials(clear, found):
        found.append(clear.probe(trial))  # noqa: PERF401 (trials look at those before)
    return found


def searched(case: ReadingCase, now: Fit) -> Findings:
    """What one step finds."""
    return search(now, case, lambda _: case.options.least_evidence, lambda *_: None, Never())
