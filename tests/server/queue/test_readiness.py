"""What the queue waits for, and what only a person can end."""

from dataclasses import replace

import pytest

from daq.owner.messages import ArmReport
from server.queue.readiness import Circumstances, what_is_missing
from tests.server.queue.bench import CALM, MOCK, REAL

READY = Circumstances(MOCK, CALM, "", consent=False, attended=True)
ASKED = replace(READY, identity=REAL, consent=True)


def _arm(**changes: object) -> ArmReport:
    return CALM.model_copy(update=changes)


@pytest.mark.parametrize("now", [READY, ASKED], ids=["a mock", "a real arm, with an operator's word"])
def test_an_arm_at_rest_needs_nothing(now: Circumstances) -> None:
    assert what_is_missing(now) is None


NO_CONNECTION = "the robot is not connected. no such port"
NO_LINK = "the link to the robot is lost"
ALONE = "no operator is present"


@pytest.mark.parametrize(
    ("now", "line", "pause"),
    [
        (replace(READY, identity=None, connection_problem="no such port"), NO_CONNECTION, ""),
        (replace(READY, arm=None, connection_problem="no such port"), NO_CONNECTION, ""),
        (replace(READY, arm=_arm(link="lost")), NO_LINK, ""),
        (replace(READY, arm=_arm(arm="disconnected")), NO_LINK, ""),
        (replace(READY, arm=_arm(activity="jog")), "the arm is busy: jog", ""),
        (replace(READY, arm=_arm(arm="stopped", cause="x")), "the arm is stopped", "the arm was stopped: look at it"),
        (replace(READY, arm=_arm(arm="fault")), "the arm has a fault", "the arm had a fault: look at it"),
        (replace(READY, identity=REAL), "an operator must allow the queue to move this arm", ""),
        (replace(ASKED, attended=False), ALONE, f"{ALONE}, and this arm may not run unattended"),
    ],
)
def test_what_is_missing_is_said_and_pauses_the_queue_where_a_person_must_look(
    now: Circumstances, line: str, pause: str
) -> None:
    missing = what_is_missing(now)
    assert missing is not None
    assert missing.line.startswith(line)
    assert missing.pause.startswith(pause) if pause else missing.pause == ""
    assert ("moves_real_arm" in missing.line) is (now.identity == REAL and not now.consent)
