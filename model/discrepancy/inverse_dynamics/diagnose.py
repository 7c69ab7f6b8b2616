"""The workflow in torque space: find what is missing, add it, see whether it holds, and again until nothing is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, Diagnosis, FoundValue, SignalError, Step, Verdict
from model.discrepancy.explanation.notes import on_stated_numbers, on_unfinished
from model.discrepancy.explanation.renderer import with_sentences
from model.discrepancy.grounds import Note, Reason, Refusal
from model.discrepancy.inverse_dynamics import judging
from model.discrepancy.inverse_dynamics.balance import TorqueBalance
from model.discrepancy.inverse_dynamics.candidates import NOT_IN_TORQUE_SPACE
from model.discrepancy.inverse_dynamics.cutoff import chosen_cutoff
from model.discrepancy.inverse_dynamics.fitting import Data, TorqueFit, fit
from model.discrepancy.inverse_dynamics.likelihood import stretches_of
from model.discrepancy.inverse_dynamics.locating import located, remaining_shapes
from model.discrepancy.inverse_dynamics.noise_floor import noise_floor
from model.discrepancy.inverse_dynamics.options import TorqueOptions, torque_options
from model.discrepancy.inverse_dynamics.records import TorqueRecord, acts_until_next_sample, torque_records
from model.discrepancy.inverse_dynamics.search import Fitted, Turn, evidence, look
from model.discrepancy.inverse_dynamics.tolerances import FITTED_SHARE, tolerances
from model.discrepancy.options import DiagnosisOptions, check_options
from model.machine_model.model import Lineage, Model

Floats = NDArray[np.float64]

FLOOR_SHARE = 0.3
"""Share of the estimated noise below which no residual is believed to be: the estimate itself is rough."""
CHANCES = 3
"""Candidates of a turn that may fail on records not fitted to before the search ends."""
SHOWN = 12
"""Candidates that a step lists."""


def diagnose_torques(
    model: Model, traces: Sequence[Trace], holdout: Sequence[Trace] = (),
    options: DiagnosisOptions | TorqueOptions | None = None, progress: Progress = silent, cancel: Cancel | None = None,
) -> Diagnosis:  # fmt: skip
    """Name the effects that recorded drive and motion show and the model lacks, add them, and show the gap shrink.

    No controller and no simulation is needed. Where nothing is held out, an effect must hold on quarters of the traces
    that are predicted from the others.

    Raises:
        TraceError, SpecError: for traces or options that cannot give an answer. CancelledError: when asked to end.
    """
    begun = time.perf_counter()
    if not traces:
        raise TraceError("no traces: a diagnosis needs at least one")
    chosen = torque_options(options)
    check_options(chosen, model)
    _refuse_unseen(chosen)
    cutoff = chosen.cutoff or chosen_cutoff(traces, model.machine)
    progress(0.0, f"low-passing the records at {cutoff:g} Hz")
    work = _Workflow(
        model, torque_records(traces, model.machine, cutoff), torque_records(holdout, model.machine, cutoff),
        noise_floor(model, traces, cutoff), chosen, progress, cancel or Never(),
    )  # fmt: skip
    work.run()
    work.notes += on_unfinished((*traces, *holdout))
    robot = sum(float(t.time[-1] - t.time[0]) for t in traces)
    names = [t.record.trace_id for t in traces]
    return work.answer(model, names, [t.record.trace_id for t in holdout], time.perf_counter() - begun, robot, cutoff)


def _refuse_unseen(options: TorqueOptions) -> None:
    """Raises SpecError for a named effect that torques do not show: that it is not found would be no answer."""
    for name in options.effects or ():
        if name in NOT_IN_TORQUE_SPACE:
            raise SpecError(f"effect {name}: cannot be found in torques: {NOT_IN_TORQUE_SPACE[name]}; leave it out")


@dataclass
class _Workflow:
    """State of a diagnosis: the model so far, its fit, the steps taken, and what was tried in a turn that took none."""

    model: Model
    records: tuple[TorqueRecord, ...]
    held: tuple[TorqueRecord, ...]
    floor: Floats
    options: TorqueOptions
    progress: Progress
    cancel: Cancel
    added: frozenset[str] = frozenset()
    steps: list[Step] = field(default_factory=list)
    tried: tuple[Candidate, ...] = ()
    notes: list[Note] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.data = Data(stretches_of(self.records), np.maximum(FLOOR_SHARE * self.floor, 1e-12))
        self.begin = self.model
        self.now = self._fit(self.model)
        self.first = self.now.values
        source = {"source": tolerances(self.model)[1], "share": FITTED_SHARE}
        self.notes.append(Note(kind="tolerance-source", values=source))

    def run(self) -> None:
        """Turn after turn, until nothing more is significant or holds."""
        while len([s for s in self.steps if s.adopted]) < self.options.most_steps:
            done = len(self.steps)
            self._tell(0.1, "what is missing")
            turn = look(self.model, self.now, self.data, self.options, self._tell, self.cancel)
            if not self._decide(turn):
                self.tried = self._candidates(turn)
                break
            self._tell(0.9, "what is not needed any more")
            self._prune(done)

    def _tell(self, fraction: float, text: str) -> None:
        stop_if(self.cancel)
        whole = self.options.most_steps
        self.progress(min(0.99, (len(self.steps) + fraction) / (whole + 1)), f"step {len(self.steps) + 1}: {text}")

    def _fit(self, model: Model, begin: dict[str, float] | None = None) -> TorqueFit:
        parameters, _ = tolerances(self.begin)
        known = {p.name for p in parameters}
        found = tuple(p for p in tolerances(model, self.added)[0] if p.name not in known)
        return fit(TorqueBalance(model, self.records), (*parameters, *found), begin or {}, self.data)

    def _decide(self, turn: Turn) -> bool:
        """Adopts the best candidate that holds. False when there is none."""
        for chosen in turn.fitted[:CHANCES]:
            if chosen.evidence < self.options.least_evidence:
                return False
            if chosen.evidence < self.options.least_evidence + self.options.echo * self._collected(chosen.joints):
                continue
            before, after = self._judged(self.now, chosen.fit)
            fell, left = (judging.mean_squares(self.data.stretches, f.residual) for f in (self.now, chosen.fit))
            if not judging.beyond_noise(fell, left, self.floor):
                continue
            removed = judging.share_removed(fell, left, before, after)
            holds = removed >= self.options.least_share
            timing = self._timing(turn, chosen) if holds else None
            if timing is not None:
                self._take(timing)
                self.notes.append(_timing_note(timing, self.records))
                return True
            self.steps.append(self._step(turn, chosen, before, after, removed, holds=holds))
            if holds:
                self._take(chosen)
                return True
        return False

    def _collected(self, joints: tuple[int, ...]) -> float:
        """Evidence that the steps taken so far have brought on these joints, or on any for the whole machine's."""
        near = (s for s in self.steps if s.adopted and (not joints or not s.joints or set(s.joints) & set(joints)))
        return sum(s.evidence for s in near)

    def _take(self, chosen: Fitted) -> None:
        self.added |= {p.name for p in chosen.parameters}
        self.model = chosen.model.with_values(chosen.fit.values)
        self.now = self._fit(self.model, chosen.fit.values)

    def _timing(self, turn: Turn, chosen: Fitted) -> Fitted | None:
        """A delay of less than a sample that explains what the chosen one does. Whether a recorded drive acted at its
        moment or until the next sample, no record tells: it is taken into the model, and is no effect."""
        if acts_until_next_sample(self.model.machine):
            return None
        least = min(record.sampled for record in self.records)
        for found in turn.fitted:
            near = chosen.evidence - found.evidence < self.options.least_margin
            if near and found.effect == "input_delay" and max(_delays(found)) < least:
                return found
        return None

    def _judged(self, before: TorqueFit, after: TorqueFit) -> tuple[Floats, Floats]:
        """Mean squares of both on records not fitted to: held-out ones, else blocks of the fitted ones."""
        if self.held:
            squares = [judging.held_out_squares(f.balance.model, f.values, self.held) for f in (before, after)]
        else:
            squares = [judging.block_squares(f, self.data) for f in (before, after)]
        return squares[0], squares[1]

    def _step(self, turn: Turn, chosen: Fitted, before: Floats, after: Floats, removed: float, *, holds: bool) -> Step:
        rivals = [c for c in turn.fitted if c.rivals(chosen) and not c.imitates(chosen, self.now)]
        margin = chosen.evidence - max([0.0, *(r.evidence for r in rivals)])
        near = [r for r in rivals if chosen.evidence - r.evidence < self.options.least_margin]
        group = {c.effect: c for c in reversed([chosen, *near])}
        values = judging.found_values(chosen.fit, chosen.parameters, self.data)
        squares = [judging.mean_squares(self.data.stretches, f.residual) for f in (self.now, chosen.fit)]
        excess = np.maximum(before - self.floor**2, 1e-300)
        usable = np.isfinite(before) & np.isfinite(after) & (before > 1.2 * self.floor**2)
        weight = np.where(usable, 1 / np.maximum(squares[0], 1e-300), 0.0)
        lost = (
            float((weight * (before - after))[usable].sum() / (weight * excess)[usable].sum()) if usable.any() else None
        )
        return Step(
            effect=chosen.effect, joints=chosen.joints, parameters=values, evidence=chosen.evidence, margin=margin,
            candidates=self._candidates(turn),
            group=tuple(self._candidate(c) for c in sorted(group.values(), key=lambda c: -c.evidence)) if near else (),
            rmse_fit=judging.signal_errors(self.model, squares[0], squares[1], self.floor),
            rmse_holdout=judging.signal_errors(self.model, before, after, self.floor) if self.held else (),
            excess_removed_holdout=lost if self.held else None,
            where=located(self.model, self.records, self.now.residual, self.data.stretches, self.floor),
            reason=UNWRITTEN, reason_data=Reason(removed=removed, slides=self._slides(chosen.joints)),
            adopted=holds, refusal=None if holds else Refusal(kind="falls-too-little", numbers={"share": removed}),
        )  # fmt: skip

    def _slides(self, joints: tuple[int, ...]) -> bool:
        machine = self.model.machine
        return all(machine.joint(j).kind == "prismatic" for j in joints or machine.modelled_joints)

    def _candidates(self, turn: Turn) -> tuple[Candidate, ...]:
        fitted = [self._candidate(c) for c in turn.fitted[:SHOWN]]
        done = {(c.effect, c.joints) for c in turn.fitted}
        cost = float(np.log(max(self.data.stretches.samples, 2)))
        others = [
            Candidate(effect=p.trial.effect, joints=p.trial.joints, evidence=p.gain - p.trial.size * cost)
            for p in turn.probed
            if (p.trial.effect, p.trial.joints) not in done
        ]
        return (*fitted, *others[: max(0, SHOWN - len(fitted))])

    def _candidate(self, c: Fitted) -> Candidate:
        squares = judging.mean_squares(self.data.stretches, c.fit.residual)
        return Candidate(
            effect=c.effect, joints=c.joints, evidence=c.evidence, refitted=True,
            misfit=float(np.nanmean(squares / self.floor**2)),
            parameters={
                p.name: FoundValue(value=c.fit.values[p.name], low=None, high=None, unit=p.unit) for p in c.parameters
            },
        )  # fmt: skip

    def _prune(self, latest: int) -> None:
        """Takes out effects of earlier steps that the latest one made superfluous."""
        for index, step in enumerate(self.steps[:latest]):
            if not step.adopted or step.effect is None:
                continue
            without = self.model.without_effect(step.effect, step.joints or None)
            kept = {n: v for n, v in self.now.values.items() if n in without.by_name}
            smaller = self._fit(without, kept)
            memory = self.now.noise.memory
            lost = evidence(smaller, self.now, self.data, memory, len(step.parameters), 1)
            if lost < 0:
                self.model, self.now = without.with_values(smaller.values), smaller
                self.added -= set(step.parameters)
                gone = {"adopted": False, "refusal": Refusal(kind="superfluous")}
                self.steps[index] = step.model_copy(update=gone)
                self.notes.append(Note(kind="taken-out-again", values={"effect": step.effect, "step": index + 1}))

    def _as_last_fitted(self) -> tuple[Step, ...]:
        """Steps with the last fit's parameters: what was still missing at their turn has bent them."""
        steps = []
        for step in self.steps:
            own = [self.model.parameter(name) for name in step.parameters] if step.adopted else []
            last = judging.found_values(self.now, own, self.data)
            if not own:
                steps.append(step)
                continue
            steps.append(step.model_copy(update={"parameters": last}))
        return tuple(steps)

    def _shares(self) -> Note:
        """Residual as a share of the recorded torque, before and after, a figure that other work gives too."""
        records = self.held or self.records
        before = judging.relative_torque_error(self.begin.with_values(self.first), records)
        after = judging.relative_torque_error(self.model.with_values(self.now.values), records)
        values = {"held_out": bool(self.held), "before": before, "after": after}
        return Note(kind="torque-left", values=values)

    def _errors(self, records: tuple[TorqueRecord, ...]) -> tuple[SignalError, ...]:
        """Of every joint on these records, from the model as it was given to the one that comes out."""
        if not records:
            return ()
        before = judging.held_out_squares(self.begin, {}, records)
        after = judging.held_out_squares(self.model, self.now.values, records)
        return judging.signal_errors(self.model, before, after, self.floor)

    def answer(
        self, before: Model, traces: list[str], holdout: list[str], seconds: float, robot: float, cutoff: float
    ) -> Diagnosis:
        """The whole answer."""
        shapes = remaining_shapes(self.model, self.records, self.now.residual, self.data.stretches, self.floor)
        steps = self._as_last_fitted()
        adopted = [s for s in steps if s.adopted]
        verdict: Verdict = "nothing-significant"
        if any(s.group for s in adopted):
            verdict = "ambiguous"
        elif adopted:
            verdict = "named"
        elif shapes:
            verdict = "unknown-effect"
        stated = on_stated_numbers((p for p in self.now.adjustables if p.name not in self.added), self.now.values)
        lineage = Lineage(
            parent=before.identity, traces=tuple(traces), fit={"fitted": [p.name for p in self.now.adjustables]},
            note="diagnosis",
        )  # fmt: skip
        after = self.model.with_values(self.now.values).with_lineage(lineage)
        left = located(self.model, self.records, self.now.residual, self.data.stretches, self.floor)
        return with_sentences(Diagnosis(
            verdict=verdict, summary=UNWRITTEN, method="inverse-dynamics", steps=steps,
            rmse_fit=self._errors(self.records), rmse_holdout=self._errors(self.held), where=left,
            candidates=self.tried, remaining=shapes, model_before=before, model_after=after, traces=tuple(traces),
            holdout=tuple(holdout), seconds=seconds, robot_seconds=robot, significant=self.options.least_evidence,
            notes_data=(*stated, self._shares(), *_assumptions(cutoff), *self.notes),
        ))  # fmt: skip


def _delays(found: Fitted) -> list[float]:
    return [found.fit.values[p.name] for p in found.parameters]


def _timing_note(found: Fitted, records: Sequence[TorqueRecord]) -> Note:
    period = min(record.sampled for record in records)
    return Note(kind="drive-timing", values={"delays": _delays(found), "period": period})


def _assumptions(cutoff: float) -> tuple[Note, ...]:
    return (
        Note(kind="cutoff", values={"cutoff": cutoff}),
        Note(kind="resting-left-out"),
        Note(kind="not-looked-for", values={"effects": NOT_IN_TORQUE_SPACE}),
        Note(kind="positions-of-links"),
    )
