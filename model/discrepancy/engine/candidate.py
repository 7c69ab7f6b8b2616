"""A fitted candidate: an effect on joints, with what fitted and held-out records say for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.discrepancy.engine.fitting import Fit
from model.effects.library import RARELY_ALONE, find_named_effect
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

ALIKE = 0.97
"""Correlation of what two effects change above which they count as the same."""
RARE = 2 * float(np.log(100.0))
"""Handicap, as evidence, of what is assumed to be a hundred times rarer than an effect that a file leaves out. A file
rarely states a number with a deviation and is wrong by many of them: on one axis a winding of twice its resistance does
nearly what a payload does. And some effects rarely act without another one."""


def numbers_of(now: Fit, parameters: Sequence[Parameter]) -> int:
    """How many numbers an effect with these parameters has in a fit, those of single records included."""
    own = {(p.effect, p.joints) for p in parameters}
    return len(parameters) + sum(u.trace is not None and (u.parameter.effect, u.joints) in own for u in now.unknowns)


@dataclass(frozen=True)
class Fitted:
    """An effect on joints with everything fitted again, and its evidence."""

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    fit: Fit
    places: int = 1
    """Starts that its own was chosen from."""
    evidence: float = 0.0
    cost: float = 0.0
    """Cost of its parameters and of the places searched, which the evidence has paid."""
    stated: tuple[Parameter, ...] = ()
    """Those of its parameters that the file states, as it states them; their priors are lifted."""
    relieved: float = 0.0
    """Part of the evidence that is of priors: of numbers that no longer have to be off."""
    told: float = 0.0
    """What held-out records say for it, as evidence; 0 where there are none."""
    told_compared: float = 0.0
    """The same, counted as for all other candidates (`holdout.Told`)."""
    ended: bool = False
    """Whether its fit has derivatives of its own to its end."""

    @property
    def size(self) -> int:
        """Numbers that it adds, those of single records included."""
        return numbers_of(self.fit, self.parameters)

    @property
    def log_odds(self) -> float:
        """Evidence of all records with the prior odds of its kind: what it competes with other candidates by."""
        beside = RARELY_ALONE.get(self.effect)
        alone = beside is not None and not any(
            use.name == beside and set(self.joints) <= set(use.joints) for use in self.model.effects
        )
        rare = alone or self.effect in MACHINE_NUMBERS
        return self.evidence + self.told_compared - (RARE if rare else 0.0)

    def rivals(self, other: Fitted) -> bool:
        """Whether both explain the same joints by different effects."""
        alike = not self.joints or not other.joints or bool(set(self.joints) & set(other.joints))
        return self.effect != other.effect and alike

    def imitates(self, other: Fitted, before: Fit) -> bool:
        """Whether this effect is a longer law of the same family that changes the same as the other one.

        Friction that falls with speed is Coulomb friction where it hardly falls: the shorter law is then its name. A
        tilted base that gives the torque of friction by direction is another thing, whatever its parameters.
        """
        family, others = (find_named_effect(f.effect).shared_name.family for f in (self, other))
        if len(self.parameters) <= len(other.parameters) or family != others:
            return False
        own, theirs = (before.weighted(f.fit.row - before.row) for f in (self, other))
        return bool(own @ theirs > ALIKE * np.linalg.norm(own) * np.linalg.norm(theirs))
