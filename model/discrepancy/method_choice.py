"""Which of the two methods a diagnosis uses, where its options leave that open."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import NoController, SampledPid
from daq.contracts.trace import Trace
from model.discrepancy.grounds import Method
from model.discrepancy.options import DiagnosisOptions
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import Model


def choose_method(model: Model, traces: Sequence[Trace], options: DiagnosisOptions, *, designs: bool) -> Method:
    """The method that the options ask for, else the one that suits machine and traces.

    Without a controller or without set points nothing can be simulated. Where a sampled controller's drive was
    recorded, the drive says what acted on the arm, whatever the controller did: torques are balanced (decision 0053).
    The loop is simulated for the board, whose readings are too coarse for accelerations; for effects that torques do
    not show; and where an experiment is to be designed, which needs simulations of the rivals.

    Args:
        designs: whether the next experiment is to be designed.

    Raises:
        SpecError: for a method that this machine or these traces do not allow.
    """
    loop_known = not isinstance(model.machine.controller, NoController) and all(t.set_point is not None for t in traces)
    if options.method == "output-error" and not loop_known:
        raise SpecError(
            "method output-error: simulates the controller, so it needs a machine file that describes one and traces "
            "with set points; leave the method out, or take inverse-dynamics"
        )
    if options.method is not None:
        return options.method
    if not loop_known:
        return "inverse-dynamics"
    unseen = set(options.effects or ()) & set(NOT_IN_TORQUES)
    if designs or unseen or not isinstance(model.machine.controller, SampledPid):
        return "output-error"
    return "inverse-dynamics" if _accelerations_are_known(model, traces) else "output-error"


def _accelerations_are_known(model: Model, traces: Sequence[Trace]) -> bool:
    """Whether the traces hold drives, and accelerations beyond the noise of their readings. A record that torques
    cannot use, as one with a gap or one of half a second, may still be simulated."""
    if any(trace.drive is None for trace in traces):
        return False
    try:
        recorded_motions(traces, model.machine, choose_cutoff(traces, model.machine))
    except (SpecError, TraceError):
        return False
    return True
