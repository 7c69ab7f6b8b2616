"""Judges whether a model explains records: the residual beyond noise, and parameters far from the file. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Self

from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Model, base_model
from model.units import shown_unit, with_unit

FAR_OFF = 4.0
"""Number of stated deviations beyond which a parameter counts as different from the file's."""
MORE_THAN_NOISE = 0.3
"""Excess variance of a joint's error, relative to its noise, above which something is missing: a nearly right law
leaves less. Chosen on tuning arms, none of which is used to report rates."""
SCATTER = 4.0
"""Standard deviations of an estimated variance, within which it may exceed its noise by chance."""


class JointLeft(FrozenRecord):
    """Residual of a model on one joint's records, in `unit`. `rms`: root mean square of the residual; `noise`: that of
    records that the model itself makes, and `scatter` the relative standard deviation of its square; `there`: of the
    recorded torque, or of the recorded motion about its mean (None if that hardly exceeds noise of the readings)."""

    joint: int
    unit: str
    rms: float
    noise: float
    scatter: float = 0.0
    there: float | None = None

    @property
    def is_more_than_there(self) -> bool:
        """Whether nothing is explained, however large the estimated noise: false readings increase that as well."""
        return self.there is not None and self.rms >= self.there > 0.0

    @property
    def in_noises(self) -> float:
        """Residual over noise: about 1 for a right model."""
        return self.rms / self.noise if self.noise > 0.0 else math.inf


class FarNumber(FrozenRecord):
    """A parameter of the model at least 4 stated deviations from the machine file. `value`: of the model; `stated`,
    `deviation`: of the file; all in `unit`."""

    name: str
    unit: str
    value: float
    stated: float
    deviation: float

    @property
    def distance(self) -> float:
        """Distance from the file in stated deviations."""
        return abs(self.value - self.stated) / self.deviation

    def __str__(self) -> str:
        """Returns the parameter beside that of the file."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{self.name} {self.value:.3g}{unit} (file: {self.stated:.3g} ± {self.deviation:.2g})"


class RecordVerdict(FrozenRecord):
    """Whether a model explains records within their noise.

    `left`: joints with more than noise, the worst first. `far`: parameters far from the machine file, the farthest
    first; they may compensate for an effect. `text`: the same in one to three sentences.
    """

    explains: bool
    left: tuple[JointLeft, ...]
    far: tuple[FarNumber, ...]
    text: str
    doubt: str = ""
    """Reason to doubt the records themselves, as a clause; the model is then not judged."""

    def doubted(self, doubt: str) -> Self:
        """Returns the verdict with a doubt about the records; an empty one changes nothing."""
        if not doubt:
            return self
        text = f"Check the record first: {doubt}. The model is not judged until then."
        return self.model_copy(update={"explains": False, "doubt": doubt, "text": text})

    @property
    def headline(self) -> str:
        """The verdict in a few words, for a list."""
        if self.doubt:
            return f"check the record: {self.doubt}"
        if self.left:
            return f"does not explain the records (joint{'s' if len(self.left) > 1 else ''} {self._joints})"
        return "explains the records" + (", with numbers far from the file" if self.far else "")

    @property
    def asks_for_diagnosis(self) -> bool:
        """Whether an effect may be missing from the model, or hidden in its numbers."""
        return not self.doubt and bool(self.left or self.far)

    @property
    def _joints(self) -> str:
        return ", ".join(str(one.joint) for one in self.left)

    @classmethod
    def of(cls, model: Model, errors: Sequence[JointLeft], samples: int) -> Self:
        """Returns the verdict on a model with these errors on records of so many samples per joint.

        A joint has more than noise beyond `most_by_chance`, or if its residual is as large as the recorded signal.
        """
        beyond = (e for e in errors if not e.in_noises <= most_by_chance(e.scatter, samples) or e.is_more_than_there)
        left = sorted(beyond, key=lambda e: e.in_noises, reverse=True)
        far = far_numbers(model)
        return cls(explains=not left, left=tuple(left), far=far, text=_text(left, far))


def most_by_chance(scatter: float, samples: int) -> float:
    """Returns the largest residual, in noises, that may be noise alone.

    Its variance may exceed the noise by the threshold at which a diagnosis looks for a missing effect, by what a
    variance of so many samples scatters, and by the `scatter` of noise from record to record, relative to its variance.
    """
    return math.sqrt(1.0 + max(MORE_THAN_NOISE, SCATTER * math.sqrt(2.0 / max(samples, 1)), SCATTER * scatter))


def far_numbers(model: Model) -> tuple[FarNumber, ...]:
    """Returns parameters of a model that are far from the machine file, the farthest first."""
    stated = base_model(model.machine).by_name
    found = [
        FarNumber(name=p.name, unit=p.unit, value=p.value, stated=s.value, deviation=s.deviation)
        for p in model.parameters
        if (s := stated.get(p.name)) is not None and s.effect is None and s.deviation
    ]
    return tuple(sorted((n for n in found if n.distance > FAR_OFF), key=lambda n: n.distance, reverse=True))


def _text(left: Sequence[JointLeft], far: Sequence[FarNumber]) -> str:
    numbers = f"Numbers far from the machine file: {'; '.join(map(str, far))}."
    if left:
        joints = "; ".join(map(_left, left))
        parts = [f"The model does not explain the records: {joints}.", "A diagnosis looks for what is missing."]
        return " ".join([parts[0], *([numbers] if far else []), parts[1]])
    if far:
        return (
            f"The model explains the records within their noise, but not with the numbers of the file. {numbers} "
            "They may stand in for a missing effect: a diagnosis compares both."
        )
    return "The model explains the records within their noise."


def _left(one: JointLeft) -> str:
    factor, unit = shown_unit(one.unit)
    size = with_unit(f"{one.rms * factor:.3g}", unit)
    if one.is_more_than_there and one.there is not None:
        return f"joint {one.joint} is left with {size}, of {with_unit(f'{one.there * factor:.3g}', unit)} recorded"
    return f"joint {one.joint} is left with {one.in_noises:.2g} times its noise ({size})"
