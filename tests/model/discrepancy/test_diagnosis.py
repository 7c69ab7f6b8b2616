"""What a fit has shown stands before what a probe promises, however much that is."""

import pytest

from model.discrepancy.diagnosis import CLEAR_SHAPE, AgainstWhat, Candidate, clear_shape, in_order
from tests.model.discrepancy.steps import shape


def candidate(effect: str, evidence: float, *, refitted: bool) -> Candidate:
    return Candidate(effect=effect, joints=(1,), evidence=evidence, refitted=refitted)


def test_fitted_candidates_come_first_each_kind_by_evidence() -> None:
    tried = (
        candidate("stiction", 10070.0, refitted=False),
        candidate("supply_limit", 182.0, refitted=True),
        candidate("backlash", 20000.0, refitted=False),
        candidate("coulomb_friction", 2064.0, refitted=True),
    )
    fitted, probed = in_order(tried)
    assert [c.effect for c in fitted] == ["coulomb_friction", "supply_limit"]
    assert [c.effect for c in probed] == ["backlash", "stiction"]


@pytest.mark.parametrize(
    ("against", "torque", "explained", "clear"),
    [
        ("time", (0.1, 0.2), 0.64, False),
        ("position", (0.1, None, 0.2, 0.3, 0.4), 0.64, False),
        ("position", (0.1, None, 0.2, 0.3, 0.4, 0.5), 0.64, True),
        ("speed", (0.1, 0.2, 0.3, 0.4, 0.5), CLEAR_SHAPE - 0.01, False),
        ("speed", (0.1, 0.2, 0.3, 0.4, 0.5), CLEAR_SHAPE, True),
        ("direction", (-0.1, None, 0.1), 0.64, True),
    ],
)
def test_a_shape_is_clear_where_it_explains_enough_in_enough_bins(
    against: AgainstWhat, torque: tuple[float | None, ...], explained: float, clear: bool
) -> None:
    left = shape(against=against, torque=torque, explained=explained)
    assert (clear_shape([left]) is not None) == clear


def test_the_clear_shape_is_the_one_that_explains_most_in_any_order() -> None:
    """Torques without a controller are listed by joint."""
    left = shape(explained=0.4)
    better = shape(joint=2, explained=0.7)
    assert clear_shape([left, better]) == better
    assert clear_shape([]) is None
