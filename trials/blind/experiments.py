"""The experiments of a trial."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from daq.contracts.carried_load import carrying
from daq.contracts.experiment import ExperimentSpec, Pause, Ramp, Segment, Sequence
from daq.contracts.machine import Machine


def trial_experiment(name: str) -> ExperimentSpec:
    """Returns `diagnostic`: the preset of 55 s. `ramp`: the source's ramp there and back, 8 s. `held-out`: the
    preset."""
    from daq.trajectories.presets import preset

    return _ramp_step() if name == "ramp" else preset(name).spec


def _ramp_step() -> ExperimentSpec:
    """Returns the ramp of 21.6° in 0.65 s, joints 1 to 3 together, held, and back."""
    segments = []
    for degrees, rest in ((21.6, 3.0), (-21.6, 3.2)):
        segments.append(Segment(move=Ramp(amplitude=math.radians(degrees), duration=0.65)))
        segments.append(Segment(move=Pause(duration=rest)))
    return ExperimentSpec(trajectory=Sequence(segments=tuple(segments)), joints=(1, 2, 3), hold=0.02, name="ramp-step")


def write_set_points(spec: ExperimentSpec, machine: Machine, path: Path) -> Path:
    """Writes the experiment's set points for the mock's side: one line per period, posture units."""
    from daq.trajectories.planner import plan, start_angles

    motion = plan(spec, machine, start_angles(spec, machine))
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow([f"set_point_{joint}" for joint in range(1, motion.postures.shape[1] + 1)])
        table.writerows(motion.postures.tolist())
    return path


def machine_with_load(machine: Machine, kilograms: float | None) -> Machine:
    """Returns the machine with the announced load; with its own for None."""
    if kilograms is None or machine.load is None:
        return machine
    return carrying(machine, kilograms, "announced")
