"""An answer with real signals behind it: an arm that lacks an effect, located, reasoned about and compared."""

import numpy as np

from daq.contracts.experiment import ExperimentSpec, SlowRamp
from daq.contracts.trace import Trace
from model.comparison.compare import Comparison, compare
from model.discrepancy.diagnosis import (
    UNWRITTEN,
    Candidate,
    Diagnosis,
    FoundValue,
    Gap,
    GapStage,
    GapWithout,
    NextExperiment,
    RemainingShape,
    SignalError,
)
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.grounds import Reason
from model.discrepancy.localisation.disagreement import locate
from model.discrepancy.localisation.phases import Residuals
from model.fitting.records import noise_floor, records_of
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.discrepancy.motions import trace_of
from tests.model.discrepancy.steps import step
from tests.model.fitting import imagined

EFFECT = "coulomb_friction"
TORQUE = 8.0
NAME = "joint2.coulomb_friction.torque"


def an_answer(seconds: float = 20.0) -> tuple[Diagnosis, Comparison]:
    """Coulomb friction of 8 N·m on joint 2, found on one trace and judged on another.

    The evidence of the candidates is imagined; residuals, places, reason and errors are computed.
    """
    before = imagined.arm()
    after = before.with_effect(EFFECT, (2,), {"torque": TORQUE})
    fit = trace_of(after, seconds)
    held = trace_of(after, seconds, seed=4)
    records = records_of([fit], before.machine, "position")
    deviations = noise_floor(records, before.machine, "position")
    left = Residuals(before, records, [residual(before, fit)], deviations)
    value = FoundValue.of(after.parameter(NAME), TORQUE, 7.8, 8.2)
    candidates = (
        Candidate(effect=EFFECT, joints=(2,), evidence=2410.0, misfit=1.02, refitted=True, parameters={NAME: value}),
        Candidate(effect="stiction", joints=(2,), evidence=1890.0, misfit=1.31, refitted=True),
        Candidate(effect="stribeck_friction", joints=(2,), evidence=1710.0, misfit=1.4, refitted=True),
        Candidate(effect="dead_zone", joints=(2,), evidence=1520.0),
        Candidate(effect="backlash", joints=(2,), evidence=420.0),
        Candidate(effect="base_tilt", joints=(), evidence=-6.0),
        Candidate(effect="viscous_friction", joints=(1,), evidence=-11.0),
    )
    comparison = compare([("before", before), ("after", after)], [fit, held], [held.record.trace_id])
    taken = step(
        EFFECT,
        (2,),
        parameters={NAME: value},
        evidence=2410.0,
        margin=520.0,
        candidates=candidates,
        rmse_fit=_errors(comparison, "in_sample"),
        rmse_holdout=_errors(comparison, "held_out"),
        excess_removed_holdout=0.982,
        where=locate(left),
        reason_data=Reason(),
    )
    asked = NextExperiment(
        name="slow reversals on joint 2",
        spec=ExperimentSpec(trajectory=SlowRamp(), joints=(2,)),
        duration=12.0,
        separates=("stiction", "stribeck_friction"),
        predicted_separation=6.4,
        reason="At 2 °/s stiction jerks and Stribeck friction does not.",
    )
    answer = Diagnosis(
        verdict="named",
        summary=UNWRITTEN,
        steps=(taken,),
        remaining=(_shape(),),
        next_experiment=asked,
        model_before=before,
        model_after=after,
        gap=_gap(comparison),
        traces=(fit.record.trace_id,),
        holdout=(held.record.trace_id,),
        seconds=4.2,
        robot_seconds=2 * seconds,
        notes=("The recorded drive was used.",),
    )
    return with_sentences(answer), comparison


def residual(model: Model, trace: Trace) -> np.ndarray:
    """Measured − simulated (m, n)."""
    record = records_of([trace], model.machine, "position")[0]
    run = simulate(model, record.inputs, Options(quantise=False))
    return np.asarray(record.measured - run.at_samples(run.reading))


def _shape() -> RemainingShape:
    centres, torque = (-0.4, -0.3, -0.2, 0.0, 0.2, 0.4), (8.0, 8.0, 7.9, None, -7.9, -8.0)
    return RemainingShape(
        joint=2,
        against="speed",
        unit="rad/s",
        torque_unit="N·m",
        centres=centres,
        torque=torque,
        deviation=(0.2, 0.2, 0.2, None, 0.2, 0.2),
        explained=0.8,
    )


def _gap(comparison: Comparison) -> Gap:
    """No number was fitted: the last two stages are alike."""
    fitted, held = _errors(comparison, "in_sample"), _errors(comparison, "held_out")
    before = {"fitted": tuple(e.before for e in fitted), "held_out": tuple(e.before for e in held)}
    after = {"fitted": tuple(e.after for e in fitted), "held_out": tuple(e.after for e in held)}
    return Gap(
        measure="closed-loop",
        joints=tuple(e.joint for e in fitted),
        units=tuple(e.unit for e in fitted),
        noise=tuple(e.floor for e in fitted),
        stages=(
            GapStage(kind="given", **before),
            GapStage(kind="effect", effect=EFFECT, joints=(2,), **after),
            GapStage(kind="refitted", **after),
        ),
        without=GapWithout(**before),
    )


def _errors(comparison: Comparison, kind: str) -> tuple[SignalError, ...]:
    before, after = (getattr(m, kind) for m in comparison.models)
    return tuple(
        SignalError(joint=b.joint, unit=b.unit, before=b.rmse, after=a.rmse, floor=b.floor)
        for b, a in zip(before, after, strict=True)
    )
