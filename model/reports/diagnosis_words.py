"""Words of a diagnosis's page: its headline, and what its numbers are of."""

from __future__ import annotations

from dataclasses import dataclass

from model.discrepancy.diagnosis import Diagnosis, FoundValue, Step
from model.discrepancy.explanation.effect_words import words_of
from model.effects.names import capitalised, placed
from model.reports.numbers import estimate
from model.reports.units import shown_unit, with_unit

NO_LAW = "none of the known effects explains what is left"


@dataclass(frozen=True)
class Compared:
    """What a diagnosis compared. residual: its name. errors: what the map is of. overlays: why there are none;
    empty where there are some."""

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


def headline(found: Diagnosis) -> str:
    """The effects found, with joints and sizes; or that none was found, or none that is known."""
    if found.verdict == "nothing-significant":
        return "Nothing that the held-out traces confirm" if found.steps else "Nothing significant"
    if found.verdict == "suspected":
        return found.summary.removesuffix(".")
    findings = [_finding(s) for s in found.steps if s.adopted]
    if found.verdict == "unknown-effect":
        findings.append(NO_LAW)
    return capitalised("; ".join(findings)) or "Several effects that cannot be told apart"


def _finding(step: Step) -> str:
    if step.group:
        return "one of: " + " or ".join(placed(c.effect, c.joints) for c in step.group)
    if step.effect is None:
        return "an effect without a name"
    size = words_of(step.effect).size
    values = [v for v in step.parameters.values() if v.part == size]
    return ", ".join([placed(step.effect, step.joints), *(_size(v) for v in values)])


def _size(v: FoundValue) -> str:
    factor, unit = shown_unit("" if v.unit == "1" else v.unit)
    low, high = (None if bound is None else factor * bound for bound in (v.low, v.high))
    value, interval = estimate(factor * v.value, low, high, digits=1)
    shown = with_unit(value, unit) if unit else value
    return shown if interval is None else f"{shown} ({interval})"


def gap(step: Step) -> str:
    """What an adopted step does on traces that it was not fitted to."""
    if step.proof is not None:
        return "Taken into the model: the recorded numbers of the controller prove it, and nothing was fitted for it."
    if step.excess_removed_holdout is None:
        return "Taken into the model. No trace was held out to judge it by."
    share = _percent(step.excess_removed_holdout, 1) or "all"
    return f"Taken into the model: on traces it was not fitted to, {share} of the variance beyond noise is gone."


def _percent(share: float, places: int) -> str | None:
    """A share in percent; None for all of it. A share below all is never rounded up to 100 %."""
    if share >= 1.0:
        return None
    return f"{min(100 * share, 100 - 10**-places):.{places}f} %".replace("-", "−")
