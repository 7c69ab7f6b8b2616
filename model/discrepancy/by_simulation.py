"""A diagnosis by output error: the closed loop is simulated from the recorded set points."""

from __future__ import annotations

import time
from collections.abc import Sequence

from daq.contracts.progress import Cancel, Progress
from daq.contracts.trace import Trace
from model.discrepancy.controller.evidence import judge_controller, with_used_set_points
from model.discrepancy.controller.sampled import with_errors
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.answer import answer_of
from model.discrepancy.engine.case import Watch
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.experiment_design.next_experiment import Asked, ExperimentChooser
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.grounds import ControllerEffect, Note
from model.discrepancy.options import DiagnosisOptions, reading_options
from model.discrepancy.readings.case import reading_case, weighed_by_noise
from model.discrepancy.readings.noise_model import note_on_noise
from model.discrepancy.thresholds import FEEDBACK_SHARE
from model.discrepancy.verdict import worse_held_out
from model.machine_model.model import Model


def diagnose_by_simulation(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace],
    options: DiagnosisOptions,
    progress: Progress,
    cancel: Cancel,
    chooser: ExperimentChooser | None,
    watch: Watch | None = None,
) -> Diagnosis:
    """The answer to traces with set points from a machine with a controller, as `workflow.diagnose` describes."""
    begun = time.perf_counter()
    progress(0.0, "checking the controller's own numbers")
    traces, holdout = (with_errors(some, model.machine) for some in (traces, holdout))
    controller = judge_controller(model, traces)
    if any(f.effect is ControllerEffect.LOST_SET_POINTS for f in controller.findings):
        # The set points that were used are known to the count.
        traces, holdout = (tuple(map(with_used_set_points, some)) for some in (traces, holdout))
    progress(0.02, "fitting the tolerance parameters")
    known = controller.with_findings(model)
    case, first = weighed_by_noise(
        reading_case(known, traces, holdout, reading_options(options), controller.settled, watch)
    )
    recorded = sum(float(t.time[-1] - t.time[0]) for t in (*traces, *holdout))
    work = Workflow(case, recorded, progress, cancel, first)
    work.run()
    progress(0.95, "writing the answer")
    answer = answer_of(work, controller.steps, traces, holdout)
    now, observation = work.found.now, case.compared.observation
    asked = Asked(None)
    if chooser is not None:
        asked = chooser.after(answer.verdict, now, work.rivals, traces, cancel)
    noisy = tuple(e.joint for e in answer.rmse_fit if e.joint not in work.left and e.after > e.floor)
    notes = (
        *answer.notes_data,
        Note(kind="tolerances-fitted-first", values={"traces": len(traces)}),
        Note(kind="errors-follow-record", values={"share": FEEDBACK_SHARE}),
        *note_on_noise(observation, now.squares**0.5, noisy if not work.found.adopted else ()),
        *(() if holdout else (Note(kind="nothing-held-out"),)),
        *asked.notes,
    )
    unknown = answer.verdict == "unknown-effect"
    found = answer.model_copy(
        update={
            "model_before": model,
            "worse_held_out": worse_held_out(answer.rmse_holdout) if unknown else (),
            "notes_data": notes,
            "next_experiment": asked.experiment,
            "inseparable": asked.inseparable,
        }
    )
    progress(1.0, "done")
    return with_sentences(found).model_copy(update={"seconds": time.perf_counter() - begun})
