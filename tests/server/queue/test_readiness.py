"""What the queue waits for, and what only a person can end."""

from dataclasses import replace

import pytest

from server.queue.readiness import Circumstances, what_is_missing
from tests.server.queue.bench import CALM, MOCK, REAL

READY = Circumstances(MOCK, CALM, "", consent=False, attended=True)


def test_a_simulated_arm_at_rest_needs_nothing() -> None:
    assert what_is_missing(READY) is None
    assert what_is_missing(replace(READY, identity=REAL, consent=True)) is None


@pytest.mark.parametrize(
    "arm", [CALM.model_copy(update={"link": "lost"}), CALM.model_copy(update={"arm": "disconnected"})]
)
def test_without_a_link_the_queue_waits(arm: object) -> None:
    missing = what_is_missing(replace(READY, arm=arm))  # type: ignore[arg-type]
    assert missing is not None
    assert (missing.line, missing.pause) == ("the link to the robot is lost", "")


def test_without_a_connection_the_queue_waits_and_says_why() -> None:
    for now in (replace(READY, identity=None), replace(READY, arm=None)):
        missing = what_is_missing(replace(now, connection_problem="no such port"))
        assert missing is not None
        assert (missing.line, missing.pause) == ("the robot is not connected. no such port", "")


def test_a_real_arm_waits_for_consent_and_holds_the_queue_without_an_operator() -> None:
    unasked = what_is_missing(replace(READY, identity=REAL))
    assert unasked is not None
    assert "moves_real_arm" in unasked.line
    assert unasked.pause == ""
    alone = what_is_missing(replace(READY, identity=REAL, consent=True, attended=False))
    assert alone is not None
    assert (alone.line, alone.pause) == (
        "no operator is present",
        "no operator is present, and this arm may not run unattended",
    )


def test_a_stop_holds_the_queue_and_a_busy_arm_only_delays_it() -> None:
    stopped = what_is_missing(replace(READY, arm=CALM.model_copy(update={"arm": "stopped", "cause": "anna"})))
    assert stopped is not None
    assert stopped.line == "the arm is stopped"
    assert stopped.pause.startswith("the arm was stopped: look at it")
    busy = what_is_missing(replace(READY, arm=CALM.model_copy(update={"activity": "jog"})))
    assert busy is not None
    assert (busy.line, busy.pause) == ("the arm is busy: jog", "")
