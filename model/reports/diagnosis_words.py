"""Words of a diagnosis's report: what its numbers are of, and what its steps did."""

from __future__ import annotations

from dataclasses import dataclass

from model.discrepancy.diagnosis import Diagnosis, SignalError, Step
from model.discrepancy.explanation.renderer import percent_gone, removed_words

NOTABLE = 1.5
"""Ratio of an error to its noise, from which the share that is gone means something."""


@dataclass(frozen=True)
class Compared:
    """What a diagnosis compared. residual: its name. errors: what errors and map are of. overlays: why there are none;
    empty where there are some."""

    residual: str
    errors: str
    overlays: str = ""


POSITIONS = Compared(
    "measured − simulated",
    "The simulation follows half of the record: its controller is given the mean of the simulated and the recorded "
    "reading. These are not the errors of the closed loop alone.",
)


def _balanced(torque: str) -> Compared:
    return Compared(
        f"{torque} that the model needs − {torque} that was applied",
        f"Both {torque}s are taken along the recorded motion, and nothing is simulated.",
        "There is no overlay: without a controller, or without set points, no motion is simulated. The map and the "
        f"errors are of {torque}s along the recorded motion.",
    )


TORQUES, FORCES = _balanced("torque"), _balanced("force")


def compared(found: Diagnosis) -> Compared:
    """Positions (speeds) where the loop was simulated, else torques, or forces where all joints slide."""
    if found.method == "output-error":
        return POSITIONS
    machine = found.model_before.machine
    slides = all(machine.joint(j).kind == "prismatic" for j in machine.modelled_joints)
    return FORCES if slides else TORQUES


def gap(step: Step) -> str:
    """What an adopted step does on traces that it was not fitted to."""
    if step.proof is not None:
        return "Taken into the model: the recorded numbers of the controller prove it, and nothing was fitted for it."
    if step.excess_removed_holdout is None:
        return "Taken into the model. No trace was held out to judge it by."
    return f"Taken into the model: {removed_words(step.excess_removed_holdout)}."


def gone(e: SignalError) -> str:
    """Share of the excess variance that is gone, never more than all of it; a dash where there was hardly any."""
    if e.before < NOTABLE * e.floor:
        return "–"
    share = (e.before**2 - e.after**2) / (e.before**2 - e.floor**2)
    return percent_gone(share, 1 if share > 0.99 else 0)


def distortion(before: float, after: float) -> str:
    """Σλ² of the distortion method before and after a step that was taken, and what it means."""
    change = f"Σλ² of the distortion method goes from {before:.3g} to {after:.3g}. "
    if before >= 1.0:
        more = "It grows because less is left to explain. " if after > before else ""
        return (
            f"{change}{more}Above 1 already before: judged by the size of the error alone, deviations of the "
            "parameters as large as expected would explain it. What speaks for the effect is its pattern, which they "
            "cannot produce."
        )
    if after >= 1.0:
        return change + "At 1 or more, deviations of the parameters as large as expected explain all that is left."
    return change + "Below 1 the expected deviations of the parameters do not explain all that is left."
