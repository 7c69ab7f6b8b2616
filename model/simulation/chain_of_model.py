"""Converts a model's bodies to a general chain, and computes gravity torques along a motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import layout as at
from model.arrays import Floats
from model.dynamics import recursive
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.simulation.bodies import chain_body


def chain_of(model: Model, vector: NDArray[Any] | None = None) -> ChainArrays:
    """Returns the model's bodies as a general chain, load and payload included, always with exact inertias."""
    numbers = model.vector if vector is None else vector
    joints = np.ascontiguousarray(numbers[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))
    return chain_body(np.ascontiguousarray(numbers[: at.SHARED]), joints, np.zeros(model.joint_count, dtype=np.int64))


def gravity_loads(model: Model, position: Floats) -> Floats:
    """Returns gravity torques (k, n), N·m or N, at joint positions (k, n)."""
    return np.asarray(recursive.gravity_along(chain_of(model), np.ascontiguousarray(position)))
