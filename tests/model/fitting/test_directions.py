"""Directions without information: their size, their deviation, and the scale of torque among them."""

import numpy as np
import pytest

from model.fitting.directions import sparse_basis, torque_scale, undetermined


def test_the_scale_of_torque_changes_each_by_its_power_of_torque() -> None:
    values, natural = np.array([2.0, 4.0, 0.3, 5.0]), np.array([1.0, 0.5, 0.1, 1.0])
    direction = torque_scale(values, natural, (1, -1, 0, 0))
    assert direction is not None
    np.testing.assert_allclose(direction, [0.25, -1.0, 0.0, 0.0])


@pytest.mark.parametrize("torque", [(0, 0), (1, 0)])
def test_fewer_than_two_with_torque_in_their_unit_have_no_scale(torque: tuple[int, ...]) -> None:
    assert torque_scale(np.ones(2), np.ones(2), torque) is None
    assert torque_scale(np.array([1.0, 0.0]), np.ones(2), (1, 1)) is None


def test_a_direction_that_the_data_know_worse_than_expected_is_told_with_its_deviation() -> None:
    found = undetermined(np.diag([100.0, 0.5, 0.0]), np.ones(3), np.array([1.0, 1.0, 2.0]), (0, 0, 0))
    assert [list(np.abs(each.members)) for each in found] == [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    assert [each.deviation for each in found] == [2.0, float("inf")]
    assert not any(each.torque_scale for each in found)


def test_a_direction_counts_in_natural_sizes() -> None:
    assert undetermined(np.diag([0.5]), np.ones(1), np.array([2.1]), (0,)) == []
    (only,) = undetermined(np.diag([0.5]), np.ones(1), np.array([1.9]), (0,))
    assert only.deviation == pytest.approx(1.0 / 0.95)


def test_the_scale_of_torque_comes_first_and_only_once() -> None:
    jacobian = np.array([[10.0, -10.0, 0.0], [0.0, 0.0, 0.0]])
    scale, other = undetermined(jacobian, np.ones(3), np.ones(3), (1, 1, 0))
    assert (scale.torque_scale, other.torque_scale) == (True, False)
    np.testing.assert_allclose(scale.members, [1.0, 1.0, 0.0])
    np.testing.assert_allclose(np.abs(other.members), [0.0, 0.0, 1.0], atol=1e-12)


def test_each_vector_of_a_basis_has_a_member_of_its_own_and_its_largest_is_one() -> None:
    rows = np.linalg.qr(np.array([[1.0, 2.0, 0.0, 0.0], [0.0, 1.0, 1.0, 3.0]]).T)[0].T
    basis = np.array(sparse_basis(rows))
    assert np.linalg.matrix_rank(np.vstack([rows, basis])) == 2
    assert basis.max(axis=1) == pytest.approx([1.0, 1.0])
    own = [any(abs(row[k]) > 0.1 and abs(other[k]) < 1e-9 for k in range(4)) for row, other in (basis, basis[::-1])]
    assert own == [True, True]
    assert sparse_basis(np.zeros((0, 4))) == []
