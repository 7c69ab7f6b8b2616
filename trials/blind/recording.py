"""Records an experiment on an arm with hidden effects in lock-step, as `daq run` does."""

from __future__ import annotations

import secrets
import shutil
import tempfile
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from daq.contracts.errors import OrderFailedError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.owner.client import OwnerOnDemand
from daq.owner.messages import Open
from trials.blind.mock_side import TrialStageError


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
