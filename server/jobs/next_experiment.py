"""Experiments that a diagnosis may propose: those of the library that the machine's limits allow and, on request,
random ones within the limits.

The service, `daq diagnose` and the diagnosing process of a blind trial use this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.safety.planned import planned

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser
import math

from daq.contracts.experiment import Cubic, ExperimentSpec, OfferedExperiment, Pause, Segment, Sequence, SlowRamp
from daq.trajectories.presets import PRESETS

GENERAL = "diagnostic"
PARTS = tuple(f"diagnostic-{letter}" for letter in "abcde")
SINGLE = ("ramp", *PARTS, "pseudo-random", "sweep")
ELSEWHERE = (40.0, 35.0, -50.0)
"""Second posture of the diagnostic set, in degrees from the rest posture."""


def offered_experiments() -> tuple[OfferedExperiment, ...]:
    """The diagnostic set, its parts, the source's ramp, pseudo-random steps, a sweep, and slow reversals at a second
    posture."""
    named = [
        OfferedExperiment(name, PRESETS[name].description, PRESETS[name].spec, name == GENERAL)
        for name in (GENERAL, *SINGLE)
    ]
    return (*named, *(_slow(speed) for speed in (2.0, 5.0)))


def _slow(speed: float) -> OfferedExperiment:
    """Reversals of all three joints at one low speed (°/s), at the second posture."""
    there = {joint: math.radians(angle) for joint, angle in enumerate(ELSEWHERE, start=1)}
    back = {joint: -angle for joint, angle in there.items()}
    size = math.radians(1.5 * speed)
    amplitude = {1: size, 2: -size, 3: size}
    moves = (
        Cubic(amplitude=there, duration=3.0),
        Pause(duration=0.5),
        SlowRamp(amplitude=amplitude, speed=math.radians(speed), reversals=3),
        Pause(duration=0.5),
        Cubic(amplitude=back, duration=3.0),
    )
    name = f"slow-reversals-{speed:g}"
    spec = ExperimentSpec(
        trajectory=Sequence(segments=tuple(Segment(move=m) for m in moves)), joints=(1, 2, 3), hold=0.5, name=name
    )
    return OfferedExperiment(name, f"slow reversals at {speed:g} °/s at a second posture", spec)


DRAWN = 40
"""Number of random experiments per question."""


def experiment_chooser(machine: Machine, budget: float | None = None, *, design: bool = False) -> ExperimentChooser:
    """Returns the experiment chooser for a machine, which plans and checks experiments. The caller runs the proposed
    ones.

    Args:
        budget: remaining robot time (s); None for no limit.
        design: also draw random experiments for each question.
    """
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser

    search = DRAWN if design else None
    return ExperimentChooser(offered_experiments(), lambda spec: planned(spec, machine), budget, search)
