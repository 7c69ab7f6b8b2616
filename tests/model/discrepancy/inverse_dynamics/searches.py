"""A diagnosis by inverse dynamics as far as its first search."""

from collections.abc import Mapping

from daq.contracts.progress import Never, silent
from model.discrepancy.inverse_dynamics.fitting import TorqueCase
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.readings import choose_cutoff, torque_noise
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs


def sliding(hidden: Mapping[str, float], options: TorqueOptions) -> TorqueWorkflow:
    """The sliding axis with its stated numbers fitted, before anything is searched."""
    model = base_model(rigs.slide_machine())
    traces = [rigs.slide_trace(seed, hidden, duration=8.0) for seed in (1, 2)]
    cutoff = choose_cutoff(traces, model.machine)
    fitted, held = (recorded_motions([t], model.machine, cutoff) for t in traces)
    case = TorqueCase(fitted, held, torque_noise(model, traces, cutoff), options)
    return TorqueWorkflow(model, case, silent, Never())
