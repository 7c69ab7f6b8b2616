"""The records of a diagnosis by inverse dynamics, and what torques below a cutoff show of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Progress
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.explanation.notes import on_unfinished
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.judged_controller import JudgedController
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.repeats import noise_left
from model.inverse_dynamics.shaking import find_shaking
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model


@dataclass(frozen=True)
class Records:
    """What a diagnosis is of: traces to fit to, and others that are held out."""

    model: Model
    traces: tuple[Trace, ...]
    held_out: tuple[Trace, ...]
    options: TorqueOptions
    controller: JudgedController
    cancel: Cancel

    def answer(self, progress: Progress) -> Diagnosis:
        """What torques show below the cutoff that was asked for, or the highest one that accelerations of the traces to
        fit to bear; without its sentences and the time that it took.

        Raises:
            TraceError, SpecError: for traces that cannot be compared in torques, or in which nothing moves beyond the
                noise of its readings. CancelledError: when asked to end.
        """
        model = self.model
        cutoff = self.options.cutoff or choose_cutoff(self.traces, model.machine)
        progress(0.0, f"low-passing the records at {cutoff:g} Hz")
        records = recorded_motions(self.traces, model.machine, cutoff)
        balance = TorqueBalance(model, records)
        case = TorqueCase(
            records,
            recorded_motions(self.held_out, model.machine, cutoff),
            noise_left(model, self.traces, balance, cutoff),
            self.options,
        )
        steps = TorqueWorkflow(model, case, self.controller, progress, self.cancel)
        steps.run()
        steps.notes += on_unfinished((*self.traces, *self.held_out))
        steps.notes += self._on_shaking()
        fitted, checked = (_identities(some) for some in (self.traces, self.held_out))
        robot = sum(float(t.time[-1] - t.time[0]) for t in self.traces)
        return steps.answer(fitted, checked, cutoff).model_copy(update={"robot_seconds": robot})

    def _on_shaking(self) -> tuple[Note, ...]:
        """A warning about joints that shake faster than torques can be compared; none where none does."""
        try:
            cutoff = choose_cutoff(self.traces, self.model.machine)
        except SpecError:  # nothing moves beyond noise, and a cutoff was asked for
            return ()
        shaking = find_shaking((*self.traces, *self.held_out), self.model.machine, cutoff)
        values = {"cutoff": cutoff, "joints": [asdict(one) for one in shaking]}
        return (Note(kind="shakes-above-cutoff", values=values, warning=True),) if shaking else ()


def _identities(traces: Sequence[Trace]) -> list[str]:
    """Each once: a trace may be in pieces."""
    return list(dict.fromkeys(t.record.trace_id for t in traces))
