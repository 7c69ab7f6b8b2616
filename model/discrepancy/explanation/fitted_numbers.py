"""Where a fit has moved the numbers that the machine file states, beside what it states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from model.discrepancy.diagnosis import Diagnosis, FoundValue
from model.discrepancy.verdict import MOST_NUMBERS
from model.machine_model.model import base_model
from model.machine_model.parameter import Parameter

MOVED = 1.0
"""Distance from the file, in stated deviations, that at least one of them must exceed: within it, a fit has found what
the file says."""
_CHANGES = {("link_mass", "added"): "link{joint}.mass", ("payload", "mass"): "load.mass"}
"""Numbers of the file that an effect's parameter adds to, by effect and part."""


@dataclass(frozen=True)
class FittedNumber:
    """A number of the machine file after a fit.

    stated, deviation: as in the file. fitted: of the resulting model. All three are in `unit`.
    """

    name: str
    unit: str
    stated: float
    deviation: float
    fitted: float

    @property
    def distance(self) -> float:
        """Distance from the file, in stated deviations."""
        return abs(self.fitted - self.stated) / self.deviation


def most_moved(found: Diagnosis) -> tuple[FittedNumber, ...]:
    """The numbers that moved most, the furthest first; none where all stayed within a deviation of the file."""
    after = found.model_after.by_name
    numbers = [
        FittedNumber(p.name, p.unit, p.value, p.deviation, after[p.name].value)
        for p in stated_numbers(found).values()
        if p.deviation and p.name in after and after[p.name].value != p.value
    ]
    numbers.sort(key=lambda n: n.distance, reverse=True)
    return tuple(numbers[:MOST_NUMBERS]) if numbers and numbers[0].distance > MOVED else ()


def stated_numbers(found: Diagnosis) -> Mapping[str, Parameter]:
    """Numbers by name as the machine file states them, whatever earlier fits have made of them."""
    return base_model(found.model_after.machine).by_name


def stated_beside(effect: str | None, name: str, value: FoundValue, stated: Mapping[str, Parameter]) -> str:
    """What the file states, beside a number that a step has named: `5.5 ± 0.5 kg`; empty where it states none. Beside
    a mass that an effect adds, it is the mass to which that is added.

    Args:
        effect: of the step. name: of its number. stated: as `stated_numbers` gives them.
    """
    changed = _CHANGES.get((effect or "", value.part))
    if changed is not None:
        name = changed.format(joint=value.joints[0] if value.joints else 0)
    p = stated.get(name)
    return "" if p is None else with_deviation(p.value, p.deviation, p.unit)


def with_deviation(value: float, deviation: float | None, unit: str) -> str:
    """A stated number: `5.5 ± 0.5 kg`."""
    spread = "" if not deviation else f" ± {deviation:.2g}"
    return f"{value:.4g}{spread}{'' if unit == '1' else f' {unit}'}"
