"""A bristle for effects that need their own."""

from __future__ import annotations

from mock_controller.plant.friction import deflect


class Bristle:
    """Dahl's bristle: deflection −1 to 1, built up over `presliding` rad of motion, in steps of `step_s`."""

    def __init__(self, presliding: float, step_s: float) -> None:
        self._presliding = presliding
        self._step_s = step_s
        self.restart()

    def restart(self) -> None:
        """Resets the deflection."""
        self._deflection = 0.0

    def advance(self, rate: float) -> float:
        """Returns the deflection after a step at `rate` (rad/s)."""
        (self._deflection,) = deflect([self._deflection], [self._step_s * rate], self._presliding)
        return self._deflection
