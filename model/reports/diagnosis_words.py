"""Words of a diagnosis's report: the meaning of its numbers, and the results of its steps."""

from __future__ import annotations

from dataclasses import dataclass

from model.discrepancy.diagnosis import Diagnosis, Step
from model.discrepancy.explanation.step_words import removed_words


@dataclass(frozen=True)
class Compared:
    """Quantity that a diagnosis compared. residual: its name. errors: of the map. overlays: why there are none; empty
    if there are some.
    """

    residual: str
    errors: str
    overlays: str = ""


POSITIONS = Compared(
    "measured − simulated",
    "The simulation follows half of the record: its controller is given the mean of the simulated and the recorded "
    "reading. The errors of the closed loop alone stand in the table of the gap.",
)


def _balanced(torque: str) -> Compared:
    return Compared(
        f"{torque} that the model needs − {torque} that was applied",
        f"Both {torque}s are taken along the recorded motion; no simulation enters the map.",
        f"There is no overlay, since the loop was not simulated: the map and the errors are of {torque}s along the "
        "recorded motion.",
    )


TORQUES, FORCES = _balanced("torque"), _balanced("force")


def compared(found: Diagnosis) -> Compared:
    """Returns positions (speeds) if the loop was simulated, else torques, or forces if all joints are prismatic."""
    if found.method == "output-error":
        return POSITIONS
    machine = found.model_before.machine
    slides = all(machine.joint(j).kind == "prismatic" for j in machine.modelled_joints)
    return FORCES if slides else TORQUES


def gap(step: Step) -> str:
    """Describes the result of an adopted step on traces that it was not fitted to."""
    if step.proof is not None:
        return "Taken into the model: the recorded numbers of the controller prove it, and nothing was fitted for it."
    if step.excess_removed_holdout is None:
        return "Taken into the model. No trace was held out to judge it by."
    return f"Taken into the model: {removed_words(step.excess_removed_holdout)}."
