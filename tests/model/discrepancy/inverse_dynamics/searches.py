"""Diagnoses by inverse dynamics: as far as the first search, and of an independent test rig."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from daq.contracts.machine import load_machine
from daq.contracts.progress import Never, silent
from daq.traces.csv_table import import_csv
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.inverse_dynamics.case import torque_case
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.readings import choose_cutoff, torque_noise
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.repeats import TorqueNoise
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from trials.rigs.folder import write_rig


def sliding(hidden: Mapping[str, float], options: TorqueOptions) -> Workflow:
    """The sliding axis with its stated numbers fitted, before anything is searched."""
    model = base_model(rigs.slide_machine())
    traces = [rigs.slide_trace(seed, hidden, duration=8.0) for seed in (1, 2)]
    cutoff = choose_cutoff(traces, model.machine)
    fitted, held = (recorded_motions([t], model.machine, cutoff) for t in traces)
    noise = TorqueNoise(torque_noise(model, traces, cutoff), fitted, np.zeros(1, dtype=bool))
    case = torque_case(model, fitted, held, noise, options)
    return Workflow(case, 16.0, silent, Never())


def diagnosed_rig(folder: Path, kind: str, seed: int, case: str | None = None, effect: str | None = None) -> Diagnosis:
    """One record of an independent test rig diagnosed, the other held out, from the files that its lab has."""
    write_rig(folder, kind, seed, case, effect)
    lab = folder / "lab"
    training, held_out = (import_csv(lab / f"{name}.csv") for name in ("training", "held_out"))
    return diagnose_torques(base_model(load_machine(str(lab / "machine.toml"))), [training], [held_out])
