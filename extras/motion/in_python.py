"""Computed set points and tracking errors, for programs and notebooks."""

from __future__ import annotations

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.safety.planned import motion_of, planned
from daq.trajectories.presets import preset
from extras.motion import inverse, learning, tracking
from extras.motion.tracking import Followed
from ma2000.progress import Shown, told
from model.machine_model.model import Model


def feedforward(
    model: Model,
    experiment: ExperimentSpec | str = "ramp",
    machine: Machine | None = None,
    *,
    progress: Shown = True,
) -> ExperimentSpec:
    """Returns an experiment with set points that make the modelled arm follow the motion of `experiment`.

    Args:
        experiment: or the name of a preset.
        machine: the machine that will run it; None for the MA2000. Its limits hold.

    `result.feedforward.expected` has the predicted tracking error of each joint. Raises SpecError, SafetyError.
    """
    machine = machine or load_machine("ma2000")
    asked = preset(experiment).spec if isinstance(experiment, str) else experiment
    with told(progress, "computing set points") as tell:
        return inverse.feedforward(model, asked, machine, lambda spec: planned(spec, machine), tell)


def learn(
    trace: Trace,
    model: Model | None = None,
    machine: Machine | None = None,
    *,
    share: float = 1.0,
) -> ExperimentSpec:
    """Returns an experiment with a recorded one's set points corrected by its tracking error: iterative learning.

    Args:
        model: of the arm's response to set points; None: estimated from the trace.
        machine: the machine that will run it; None for that of the trace.
        share: of the correction that is applied, above 0 and up to 1.

    Raises TraceError for an unsuitable trace; SpecError, SafetyError.
    """
    own = machine or trace.record.machine
    if own is None:
        raise TraceError(f"trace {trace.record.trace_id}: does not state its machine")
    return learning.learn(trace, own, lambda one: planned(one, own), model, share)


def followed(trace: Trace) -> Followed | None:
    """Returns the motion of a trace's experiment beside the arm's, with the tracking error of each joint.

    None for a trace that does not state its experiment. Raises SpecError, TraceError.
    """
    machine = trace.record.machine
    return None if machine is None else tracking.followed(trace, lambda spec: motion_of(spec, machine))
