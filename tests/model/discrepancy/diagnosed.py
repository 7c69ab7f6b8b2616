"""The whole workflow, from the mock's wire to the answer."""

from pathlib import Path

from daq.contracts.machine import load_machine
from daq.trajectories.presets import preset
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.machine_model.model import base_model
from tests.model.discrepancy.recording import recorded


def diagnosed(
    folder: Path, *modifications: str, experiment: str = "diagnostic", options: DiagnosisOptions | None = None
) -> Diagnosis:
    """The answer to an experiment (by default the 55 s set) and a held-out trace of an arm with those effects."""
    machine = load_machine("ma2000")
    specs = [preset(experiment).spec, preset("held-out").spec]
    fitted, held = recorded(specs, machine, seed=7, folder=folder, modifications=modifications)
    return diagnose(base_model(machine), [fitted], [held], options)
