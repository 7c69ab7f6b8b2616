"""Runs the whole reproduction of `daq thesis` and returns one typed result: our values beside the published ones."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.progress import Cancel, Progress, silent
from daq.contracts.trace import Trace
from extras.thesis.check import Check, Choice
from extras.thesis.control_cases import ControlChapter, control_chapter
from extras.thesis.figures import TorqueFigures, influence_tables, torque_figures
from extras.thesis.influence import Influence
from extras.thesis.ladder import Ladder, Method, climb_ladder, not_recovered
from extras.thesis.tables import RecomputedFidelity, recomputed_fidelities

RECOMPUTED_TOLERANCE = 0.03
"""Largest relative difference at which Σλ² recomputed from the tables counts as the published one."""


class Reproduction(FrozenRecord):
    """The source, reproduced. `fidelity` holds both conventions of τ′, the source's first. `ladders`, one per method:
    the four models of chapter 7, fitted one after the other."""

    fidelity: tuple[RecomputedFidelity, ...]
    influence: tuple[Influence, ...]
    ladders: tuple[Ladder, ...]
    figures: TorqueFigures
    control: ControlChapter
    checks: tuple[Check, ...]
    choices: tuple[Choice, ...]
    findings: tuple[str, ...]

    @property
    def failed(self) -> tuple[Check, ...]:
        """Statements of the source with which the reproduction does not agree."""
        return tuple(c for c in self.checks if not c.holds)


def reproduce_thesis(
    traces: Sequence[Trace],
    methods: Sequence[Method] = ("nelder_mead", "least_squares"),
    *,
    evaluations: int | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Reproduction:
    """Reproduces chapters 5, 7 and 8.

    Args:
        traces: of a plant with complete friction, with the experiment's ramp (section 6.5); the first gives the motion
            of figures 7.12 to 7.14.
        methods: of fitting; the source's is `nelder_mead`. evaluations: of one fit, at most.

    Raises:
        SpecError: without traces or methods. TraceError: for traces that cannot be simulated.
        CancelledError: when cancelled.
    """
    if not traces or not methods:
        raise SpecError("the reproduction needs at least one trace and one method of fitting")
    fidelity = (*recomputed_fidelities("source"), *recomputed_fidelities("three_sigma"))
    influence = influence_tables()
    progress(0.05, "tables of chapters 5 and 7 recomputed")
    ladders = []
    for k, method in enumerate(methods):

        def tell(fraction: float, text: str, k: int = k, method: Method = method) -> None:
            progress(0.05 + 0.8 * (k + fraction) / len(methods), f"{method}: {text}")

        ladders.append(climb_ladder(traces, method, evaluations=evaluations, progress=tell, cancel=cancel))
    figures = torque_figures(traces[0])
    control = control_chapter(lambda f, text: progress(0.85 + 0.15 * f, text), cancel)
    sums = [_recomputed(f) for f in fidelity if f.convention == "source"]
    steps = [c.model_copy(update={"name": f"{x.method}: {c.name}"}) for x in ladders for c in x.checks]
    progress(1.0, "done")
    return Reproduction(
        fidelity=fidelity,
        influence=influence,
        ladders=tuple(ladders),
        figures=figures,
        control=control,
        checks=(*sums, *_tables(influence), *steps, *figures.checks, *control.checks),
        choices=(*_experiment(traces), *ladders[0].choices, *control.choices),
        findings=(*FINDINGS, *(not_recovered(ladder) for ladder in ladders), *control.findings),
    )


def _recomputed(f: RecomputedFidelity) -> Check:
    return Check(
        name=f"Σλ² of the {f.name} model from tables {f.table} and {f.deviation_table}",
        holds=abs(f.relative_difference) <= RECOMPUTED_TOLERANCE,
        ours=f"{f.ours:.4f} ({f.relative_difference:+.1%})",
        published=f"{f.published:.4f}",
    )


def _tables(influence: Sequence[Influence]) -> list[Check]:
    checks = []
    for entry in influence:
        too_many, too_few = entry.published_too_many, entry.published_too_few
        said = [f"without effect: {', '.join(too_many)}"] if too_many else []
        said += [f"missing: {', '.join(too_few)}"] if too_few else []
        where = f"link {entry.joint}" if entry.table == "5.3" else f"joint {entry.joint}"
        ours, published = "; ".join(said) or "as published", f"{len(entry.published)} parameters"
        checks.append(Check(name=f"table {entry.table}, {where}", holds=not said, ours=ours, published=published))
    return checks


def _experiment(traces: Sequence[Trace]) -> tuple[Choice, ...]:
    first = traces[0]
    start = ", ".join(f"{q:.3f}" for q in first.position[0])
    length = float(first.time[-1] - first.time[0])
    gains = "as in the machine file" if first.record.gains is None else str(first.record.gains)
    taken = f"settings {gains}; counts to volts as in the machine file"
    missing = "P = 2 is given, the physical gain and the converter's span are not"
    return (
        Choice(what="start posture of the ramp", value=f"{start} rad", why="not given"),
        Choice(what="length of the record", value=f"{length:.2f} s, {len(first)} samples", why="not given"),
        Choice(what="actual gain", value=taken, why=missing),
        Choice(what="plant", value="the trace's: " + first.record.source, why="the measured traces of 1991 are lost"),
    )


FINDINGS = (
    (
        "The published Σλ² follow from the published tables with τ′ = â/(3√2) for K_b, v_eff and μ̃, not with "
        "â/3, which the text describes and which gives 42 to 46 % more."
    ),
    (
        "Table 5.1 names too many parameters for the waist: the shoulder lies on the waist's axis, so mass and "
        "centre of link 2 have no arm there, and I*zz of links 2 and 3 acts about axes at right angles to it. "
        "Table 5.2 names too many for it too: with the waist at rest, links 2 and 3 reach it through products of "
        "inertia and offsets along z alone."
    ),
    (
        "K_b2 and v_eff2 cannot be told apart by voltage and position: only K_b2 + v_eff2 R/K_T can. It is "
        "0.0747, 0.0707 and 0.0714 V·s/rad in tables 7.5, 7.7 and 7.9; that K_b2 returns to its data sheet once "
        "viscous friction is in the model is a matter of where the fit starts, not of the record."
    ),
)
"""What the reproduction shows beyond the source."""
