"""Chapter 8, as far as it can be reproduced."""

import math
import threading
from itertools import pairwise

import pytest

from daq.contracts.progress import CancelledError
from extras.thesis.control_cases import ControlChapter, control_chapter, lags


@pytest.fixture(scope="module")
def chapter() -> ControlChapter:
    return control_chapter()


def test_better_models_follow_better(chapter: ControlChapter) -> None:
    names = ("case 1: basic", "case 2: viscous", "case 3: complete")
    cases = [chapter.case(f"{n}, back-EMF of the plant") for n in names]
    assert max(cases[0].first_amplitude_ratio) < 0.8
    for worse, better in pairwise(cases):
        assert all(b < w for w, b in zip(worse.rms, better.rms, strict=True))
    assert cases[2].amplitude_ratio == pytest.approx((1, 1, 1), abs=0.01)


def test_the_tabled_back_emf_of_the_basic_model_is_too_much_for_the_plant(chapter: ControlChapter) -> None:
    assert chapter.case("case 1: basic, back-EMF as tabled").amplitude_ratio[0] > 1.5


def test_in_the_last_case_both_readings_of_the_law_give_the_same(chapter: ControlChapter) -> None:
    one, other = (chapter.case(f"case 3: complete, back-EMF {w}") for w in ("as tabled", "of the plant"))
    assert one.position == other.position


def test_pid_follows_and_overshoots_from_another_posture(chapter: ControlChapter) -> None:
    pid, other = chapter.case("PID"), chapter.case("PID from 90°")
    assert min(pid.amplitude_ratio) > 0.9
    assert max(math.degrees(r) for r in pid.rms) < 3
    assert pid.overshoot[1] < math.radians(0.5)
    assert other.overshoot[1] > math.radians(2)


def test_pid_lags_on_every_joint(chapter: ControlChapter) -> None:
    """Seen from the other side, as if the wanted motion followed the position, it leads by as much."""
    pid = chapter.case("PID")
    assert min(lags(pid)) > math.radians(0.5)
    assert max(lags(pid)) < math.radians(10)
    leading = pid.model_copy(update={"wanted": pid.position, "position": pid.wanted})
    assert lags(leading) == pytest.approx([-lag for lag in lags(pid)])
    assert "lag" in next(c.ours for c in chapter.checks if c.name == "PID follows with a lag")


def test_statements_that_do_not_come_out_are_among_the_findings(chapter: ControlChapter) -> None:
    failed = {c.name for c in chapter.checks if not c.holds}
    assert failed == {"with the tabled back-EMF constants cases 1 and 2 are damped", "PID from 90°: joint 3 overshoots"}


def test_the_chapter_can_be_cancelled() -> None:
    now = threading.Event()
    now.set()
    with pytest.raises(CancelledError):
        control_chapter(cancel=now)
