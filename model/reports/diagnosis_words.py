"""What the page of a diagnosis says in words: its headline, and what its numbers are of."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.machine import NoController
from model.discrepancy.diagnosis import Diagnosis, FoundValue, SignalError, Step
from model.discrepancy.explanation.table import telling
from model.reports.effect_names import capitalised, placed
from model.reports.numbers import estimate
from model.reports.units import shown_unit, with_unit

NOTABLE = 1.5
"""Times the noise from which an error is large enough to ask for the share that is gone."""
NO_LAW = "none of the known effects explains what is left"


@dataclass(frozen=True)
class Compared:
    """What a diagnosis compared. residual: what is left, in words. errors: what errors and map are of. overlays: why
    there are none; empty where there are some."""

    residual: str
    errors: str
    overlays: str = ""


POSITIONS = Compared(
    "measured − simulated",
    "The simulation follows half of the record: its controller is given the mean of the simulated and the recorded "
    "reading. These are not the errors of the closed loop alone.",
)
TORQUES = Compared(
    "torque that the model needs − torque that was applied",
    "Both torques are taken along the recorded motion, and nothing is simulated.",
    "There is no overlay: without a controller, or without set points, no motion is simulated. The map and the errors "
    "are of torques along the recorded motion.",
)
FORCES = Compared(*(text.replace("torque", "force") for text in (TORQUES.residual, TORQUES.errors, TORQUES.overlays)))


def compared(found: Diagnosis) -> Compared:
    """Torques (forces, where all joints slide) without a controller or set points, else positions (speeds)."""
    units = {e.unit for e in (*found.rmse_fit, *(e for step in found.steps for e in step.rmse_fit))}
    if not units & {"N·m", "N"} and not isinstance(found.model_before.machine.controller, NoController):
        return POSITIONS
    return FORCES if units == {"N"} else TORQUES


def headline(found: Diagnosis) -> str:
    """What was found, where, and its size; or that nothing was, or nothing known."""
    if found.verdict == "nothing-significant":
        return "Nothing that the held-out traces confirm" if found.steps else "Nothing significant"
    told = [_finding(s) for s in found.steps if s.adopted]
    if found.verdict == "unknown-effect":
        told.append(NO_LAW)
    return capitalised("; ".join(told)) or "Several effects that cannot be told apart"


def _finding(step: Step) -> str:
    if step.group:
        return "one of: " + " or ".join(placed(c.effect, c.joints) for c in step.group)
    if step.effect is None:
        return "an effect without a name"
    size = telling(step.effect).size
    values = [v for name, v in step.parameters.items() if size is not None and name.rsplit(".", 1)[-1] == size]
    return ", ".join([placed(step.effect, step.joints), *(_size(v) for v in values)])


def _size(v: FoundValue) -> str:
    factor, unit = shown_unit("" if v.unit == "1" else v.unit)
    low, high = (None if bound is None else factor * bound for bound in (v.low, v.high))
    value, interval = estimate(factor * v.value, low, high, digits=1)
    told = with_unit(value, unit) if unit else value
    return told if interval is None else f"{told} ({interval})"


def proved(step: Step) -> bool:
    """Whether the controller's own numbers prove a step: then nothing was fitted for it, and it has no errors."""
    return step.adopted and not any(e.before or e.after for e in step.rmse_fit)


def gap(step: Step) -> str:
    """What a step that was taken does on traces it was not fitted to."""
    if proved(step):
        return "Taken into the model: the recorded numbers of the controller prove it, and nothing was fitted for it."
    if step.excess_removed_holdout is None:
        return "Taken into the model. No trace was held out to judge it by."
    told = _percent(step.excess_removed_holdout, 1) or "all"
    return f"Taken into the model: on traces it was not fitted to, {told} of the variance beyond noise is gone."


def gone(e: SignalError) -> str:
    """Share of the excess variance that is gone, never more than all of it; a dash where there was hardly any."""
    if e.before < NOTABLE * e.floor:
        return "–"
    share = (e.before**2 - e.after**2) / (e.before**2 - e.floor**2)
    return _percent(share, 1 if share > 0.99 else 0) or "all of it"


def _percent(share: float, places: int) -> str | None:
    """A share in percent; None for all of it. What is not all is never rounded up to it."""
    if share >= 1.0:
        return None
    return f"{min(100 * share, 100 - 10**-places):.{places}f} %".replace("-", "−")


def distortion(before: float, after: float) -> str:
    """Σλ² of the distortion method before and after a step that was taken, and what it means."""
    told = f"Σλ² of the distortion method goes from {before:.3g} to {after:.3g}. "
    if before >= 1.0:
        more = "It grows because less is left to explain. " if after > before else ""
        return (
            f"{told}{more}Above 1 already before: judged by the size of the error alone, deviations of the parameters "
            "as large as expected would explain it. What speaks for the effect is the pattern, which they cannot make."
        )
    if after >= 1.0:
        return told + "At 1 or more, deviations of the parameters as large as expected explain all that is left."
    return told + "Below 1 the expected deviations of the parameters do not explain all that is left."
