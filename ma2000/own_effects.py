"""The names that the file of a user-defined effect imports (docs/own-effect.md).

The functions accept real and dual numbers, so that derivatives stay exact.
"""

from __future__ import annotations

from model.effects.own import OwnEffect, OwnParameter
from model.effects.own_math import clamped, larger, magnitude, outside, sign, smaller

__all__ = ["OwnEffect", "OwnParameter", "clamped", "larger", "magnitude", "outside", "sign", "smaller"]
