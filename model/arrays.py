"""Types of arrays; their shapes are stated where they are used."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""An array of real numbers."""
Integers = NDArray[np.int64]
"""An array of whole numbers."""
Mask = NDArray[np.bool_]
"""An array of truth values, such as a selection of samples."""
Array = NDArray[Any]
"""An array in compiled code: real numbers, or dual numbers (complex128)."""
