"""Records an experiment on an arm with hidden effects in lock-step, as `daq run` does."""

from __future__ import annotations

import csv
import math
import secrets
import shutil
import tempfile
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from daq.contracts.carried_load import carrying
from daq.contracts.errors import OrderFailedError
from daq.contracts.experiment import ExperimentSpec, Pause, Ramp, Segment, Sequence
from daq.contracts.machine import Machine
from daq.owner.client import OwnerOnDemand
from daq.owner.messages import Open
from trials.blind.sealed import TrialStageError


@dataclass(frozen=True)
class Recorded:
    """A trace under a random name, and how the run ended."""

    file: Path
    outcome: str
    reason: str
    duration: float
    """Robot time in s."""


def record(seed: int, run: str, spec: ExperimentSpec, machine: Machine, folder: Path) -> Recorded:
    """Runs `spec` on the arm of a seed. `run` draws the noise: it differs between runs of the same arm.

    Neither the seed nor its noise is in the trace or its name (a test checks that). Raises TrialStageError.
    """
    noise = int(sha256(f"noise {seed} {run}".encode()).hexdigest()[:7], 16)
    with tempfile.TemporaryDirectory(prefix="trial-") as place:
        opening = Open(
            url=f"mock://?lock_step=1&secret={seed}&seed={noise}",
            machine=machine,
            limits=machine.limits,
            folder=Path(place),
            robot=f"trial-{secrets.token_hex(4)}",  # its stop socket: runs may happen at the same time
        )
        try:
            with OwnerOnDemand(opening) as owner:
                finished = owner.run(spec)
        except OrderFailedError as error:
            raise TrialStageError(f"nothing was recorded: {error}") from error
        kept = folder / f"{secrets.token_hex(6)}.mcap"
        shutil.move(finished.trace, kept)
    period = machine.controller.period.value if machine.controller.kind != "none" else 0.0
    return Recorded(kept, finished.outcome, finished.reason, finished.samples * period)


# --- The experiments of a trial


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
