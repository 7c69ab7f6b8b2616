"""A mock arm with hidden parameters, and its traces, for the benchmarks of the model.

Everything is done as with a real arm: a mock process behind a port, experiments run by `daq`, trace files read back.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from urllib.parse import urlencode

import numpy as np

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.runner.recorder import RunListener
from daq.traces.reader import read_trace
from model.machine_model.model import base_model

PLANT_NAMES: dict[str, tuple[str, ...]] = {
    "link1.mass": ("rigid_body.m1",),
    "link2.mass": ("rigid_body.m2",),
    "link3.mass": ("rigid_body.m3",),
    "load.mass": ("rigid_body.m_load",),
    "link1.radius": ("rigid_body.r1",),
    "link2.length": ("rigid_body.a2",),
    "link3.length": ("rigid_body.a3",),
    "friction.arm": ("friction.effective_arm",),
    **{f"joint{j}.motor.back_emf_constant": (f"joint_{j}.back_emf_constant",) for j in (1, 2, 3)},
    **{f"joint{j}.motor.rotor_inertia": (f"joint_{j}.rotor_inertia",) for j in (1, 2, 3)},
    **{f"joint{j}.viscous_friction.coefficient": (f"joint_{j}.viscous_friction",) for j in (1, 2, 3)},
}
"""Names of the model's parameters and their place in the mock's plant file, which has one arm of friction for all
joints.
"""

FRICTION_ARMS = tuple(f"joint{j}.load_dependent_friction.arm" for j in (1, 2, 3))


class Unheard(RunListener):
    """A run listener that ignores everything."""


def hidden_parameters(machine: Machine, seed: int) -> dict[str, float]:
    """Returns true values of an arm, drawn from the machine file: value ± deviation, Gaussian, kept positive."""
    rng = np.random.default_rng([1991, seed])
    model = base_model(machine)
    found = {}
    for name in PLANT_NAMES:
        p = model.parameter(FRICTION_ARMS[0] if name == "friction.arm" else name)
        deviation = 0.0 if p.deviation is None else p.deviation
        found[name] = max(p.value + deviation * rng.standard_normal(), 0.05 * p.value)
    return found


def plant_text(hidden: Mapping[str, float]) -> str:
    """Returns the mock's own plant file with these values."""
    text = resources.files("mock_controller.plant").joinpath("ma2000_plant.toml").read_text("utf-8")
    for name, value in hidden.items():
        for place in PLANT_NAMES[name]:
            text = _replaced(text, place, value)
    return text


def recorded(
    specs: Sequence[ExperimentSpec], machine: Machine, seed: int, plant: str | None = None, modify: Sequence[str] = ()
) -> list[Trace]:
    """Returns traces of experiments, one after the other on one mock in lock-step, with these hidden effects."""
    options: dict[str, str | list[str]] = {"lock_step": "1", "seed": str(seed), "modify": list(modify)}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if plant is not None:
            (folder / "plant.toml").write_text(plant, "utf-8")
            options["plant"] = str(folder / "plant.toml")
        with Controller.connect(f"mock://?{urlencode(options, doseq=True)}") as controller:
            return [read_trace(record(controller, spec, machine, folder)) for spec in specs]


def record(controller: Controller, spec: ExperimentSpec, machine: Machine, folder: Path) -> Path:
    """Returns the trace of an experiment. Raises RuntimeError if it is not complete."""
    control = ArmControl(controller)
    run = RunSetup(controller, control, spec, machine, machine.limits, folder, Unheard(), StopRequests())
    result = run_experiment(run, Consent())
    if result.outcome != "complete":
        raise RuntimeError(f"{spec.name or spec.trajectory.kind} ended {result.outcome}: {result.reason}")
    return result.trace


def _replaced(text: str, place: str, value: float) -> str:
    table, _, key = place.partition(".")
    pattern = rf"(?ms)(^\[{re.escape(table)}\].*?^{re.escape(key)} = \{{ value = )[^,]+"
    changed, count = re.subn(pattern, lambda m: f"{m.group(1)}{value!r}", text, count=1)
    if count != 1:
        raise RuntimeError(f"{place} is not in the file")
    return changed
