"""Decides whether the queue may move the arm now, and if not, says what is missing. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.consent import lacks_consent
from daq.contracts.service.experiments import Reviewer
from daq.contracts.service.robot import RobotIdentity
from daq.owner.messages import ArmReport


@dataclass(frozen=True)
class Circumstances:
    """Everything that the decision depends on. `attended`: an operator has confirmed presence, or none is needed."""

    identity: RobotIdentity | None
    arm: ArmReport | None
    connection_problem: str
    consent: bool
    attended: bool


@dataclass(frozen=True)
class Missing:
    """What is missing, in one line. `pause`: why the queue must be paused until a person has looked; empty if waiting
    is enough."""

    line: str
    pause: str = ""


def why_paused(arm: ArmReport) -> str:
    """Returns why the queue must wait for a person after a stop or a fault of the arm; empty in every other state.

    It holds after the reset as well. The arm itself says the cause, and until the reset that one is needed.
    """
    if arm.arm not in ("stopped", "fault"):
        return ""
    return f"the arm {'was stopped' if arm.arm == 'stopped' else 'had a fault'}: look at it, then resume the queue"


def approval_missing(experiments: int, reviewer: Reviewer | None) -> str:
    """Returns what so many experiments without an approval wait for; empty for none."""
    if experiments == 0 or reviewer is None:
        return ""
    who = "an operator" if reviewer == "operator" else "an owner of the robot"
    return f"the approval of {experiments} experiment{'s' * (experiments > 1)} by {who} who did not submit it"


def what_is_missing(now: Circumstances) -> Missing | None:
    """Returns the first thing that is missing; None if an experiment may begin."""
    if now.identity is None or now.arm is None:
        return Missing(f"the robot is not connected. {now.connection_problem}".strip())
    state, cause = now.arm.arm, why_paused(now.arm)
    found = [
        (now.arm.link == "lost" or state == "disconnected", Missing("the link to the robot is lost")),
        (cause != "", Missing(f"the arm {'is stopped' if state == 'stopped' else 'has a fault'}", cause)),
        (now.arm.activity != "none", Missing(f"the arm is busy: {now.arm.activity}")),
        (
            lacks_consent(now.identity, now.consent),
            Missing("an operator must allow the queue to move this arm: pause it, then resume it (moves_real_arm)"),
        ),
        (
            not now.attended,
            Missing("no operator is present", "no operator is present, and this arm may not run unattended"),
        ),
    ]
    return next((missing for applies, missing in found if applies), None)
