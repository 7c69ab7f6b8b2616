"""Forward kinematics of the chain in machine files."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.trajectories.kinematics import link_ends
from tests.daq.safety.arms import MA2000

A2, A3 = 0.285755, 0.16841
angle = st.floats(-math.pi, math.pi)


def ends(*angles: float) -> np.ndarray:
    return link_ends(MA2000, np.array([angles + (0.0,) * (6 - len(angles))]))[0]


@given(angle, angle, angle)
def test_major_axes_agree_with_plane_geometry(waist: float, shoulder: float, elbow: float) -> None:
    radius = A2 * math.cos(shoulder) + A3 * math.cos(shoulder + elbow)
    height = A2 * math.sin(shoulder) + A3 * math.sin(shoulder + elbow)
    expected = [radius * math.cos(waist), radius * math.sin(waist), height]
    assert ends(waist, shoulder, elbow)[2] == pytest.approx(expected, abs=1e-12)


@given(st.lists(angle, min_size=6, max_size=6))
def test_no_link_changes_its_length(angles: list[float]) -> None:
    origins = np.concatenate([np.zeros((1, 3)), ends(*angles)])
    lengths = np.linalg.norm(np.diff(origins, axis=0), axis=1)
    assert lengths == pytest.approx([0, A2, A3, 0, 0, 0], abs=1e-12)


def test_a_prismatic_joint_moves_along_its_axis() -> None:
    first = MA2000.joints[0].model_copy(update={"kind": "prismatic"})
    slide = MA2000.model_copy(update={"joints": (first,)})
    assert link_ends(slide, np.array([[0.25]]))[0, 0] == pytest.approx([0, 0, 0.25])
