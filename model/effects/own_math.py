"""Functions with corners for the torque of a user's effect; they also carry exact derivatives.

Python's abs, min, max and comparisons lose them: a derivative is carried in the imaginary part of a complex number. For
smooth functions use numpy's: np.exp, np.sin, np.cos, np.tanh, np.sqrt, np.log. Compare `.real` parts only.
"""

from __future__ import annotations

from typing import Any

from model.drives.piecewise import clamped, magnitude, outside
from model.dynamics.compilation import inlined

__all__ = ["clamped", "larger", "magnitude", "outside", "sign", "smaller"]


@inlined
def sign(x: Any) -> Any:
    """Returns −1, 0 or 1; its derivative is zero."""
    return 0.0 * x + (1.0 if x.real > 0.0 else (-1.0 if x.real < 0.0 else 0.0))


@inlined
def larger(x: Any, y: Any) -> Any:
    """Returns the larger of two numbers, with its derivative."""
    return x + 0.0 * y if x.real >= y.real else y + 0.0 * x


@inlined
def smaller(x: Any, y: Any) -> Any:
    """Returns the smaller of two numbers, with its derivative."""
    return x + 0.0 * y if x.real <= y.real else y + 0.0 * x
