"""What the tolerance parameters explain, where nothing is known of one of them."""

import numpy as np
import pytest

from model.discrepancy.candidates.probing import inverse_of


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e12])
def test_a_number_of_which_nothing_is_known_explains_nothing(size: float) -> None:
    """The position at which a cable begins to pull that is never taut."""
    information = size * np.array([[4.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 9.0]])
    found = inverse_of(information)
    assert not found[1].any()
    assert not found[:, 1].any()
    kept = np.ix_([0, 2], [0, 2])
    np.testing.assert_allclose(found[kept], np.linalg.inv(information[kept]), rtol=1e-9)
