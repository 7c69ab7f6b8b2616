"""What the tolerance parameters explain, where nothing is known of one of them."""

import numpy as np
import pytest

from model.discrepancy.candidates.probing import inverse_of


def test_the_inverse_is_the_inverse_where_there_is_one() -> None:
    information = np.array([[4.0, 1.0], [1.0, 9e12]])
    np.testing.assert_allclose(inverse_of(information) @ information, np.eye(2), atol=1e-9)


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e12])
def test_a_number_of_which_nothing_is_known_explains_nothing(size: float) -> None:
    """The position at which a cable begins to pull that is never taut."""
    information = size * np.array([[4.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 9.0]])
    found = inverse_of(information)
    assert not found[1].any()
    assert not found[:, 1].any()
    kept = np.ix_([0, 2], [0, 2])
    np.testing.assert_allclose(found[kept], np.linalg.inv(information[kept]), rtol=1e-9)
