"""Memory maps that the mock hides are found again, nothing is found wrongly, and nothing unproved is written."""

import pytest

from firmware_protocol.memory_map import JOINTS
from mock_controller.hidden.memory import Documented
from tests.extras.commissioning.memory.secret_maps import LEAST_FOUND, TARGET, Score, search


def require(score: Score) -> None:
    assert score.wrong == ()
    assert score.unproved_writes == 0
    assert score.contradiction_told


def test_a_secret_map_is_found_and_its_set_points_are_proved_by_command() -> None:
    score = search(2, "moved")
    require(score)
    assert all(score.found[name] == JOINTS for name in (*TARGET, "set_point"))
    assert score.proofs == JOINTS


@pytest.mark.slow
def test_secret_maps_are_found_whether_or_not_they_keep_the_documented_addresses() -> None:
    kinds: tuple[Documented, ...] = ("kept", "moved")
    scores = [search(seed, kind) for seed in (100, 101, 102) for kind in kinds]
    for score in scores:
        require(score)
    for name in TARGET:
        assert sum(score.found[name] for score in scores) >= LEAST_FOUND * JOINTS * len(scores)
