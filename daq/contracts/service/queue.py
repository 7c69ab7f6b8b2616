"""The queue of one robot, and who may move it."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime, StrictBool

from daq.contracts.service.base import Wire

Role = Literal["viewer", "operator", "owner", "admin"]
"""Roles (docs/service.md). A viewer looks and stops. An operator also moves the arm and changes their own experiments.
An owner is responsible for an arm, and changes all its experiments. An admin is an owner of all arms."""
ROLES: tuple[Role, ...] = ("viewer", "operator", "owner", "admin")
"""All roles in order; each includes the rights of those before it."""
Reviewer = Literal["operator", "owner"]
"""Who must approve an experiment before it moves a real arm: another operator, or another owner of the robot."""


def role_of(text: str) -> Role:
    """Returns the role of this name. A role that only a newer version knows counts as viewer."""
    return next((role for role in ROLES if role == text), "viewer")


class QueueStatus(Wire):
    """Whether experiments are taken from the queue, and if not, why.

    `waiting_for`: why nothing runs although the queue is not paused, in one line; empty if an experiment runs or none
    waits.
    """

    paused: bool
    reason: str
    """Why it is paused; otherwise who resumed it."""
    since: AwareDatetime
    queued: int
    running: str | None = None
    """The running experiment."""
    waiting_for: str = ""
    attended_until: AwareDatetime | None = None
    """For a real arm that may not run unattended: until when an operator has confirmed being present."""
    review: Reviewer | None = None
    """Who must approve an experiment before it moves a real arm; None: nobody."""


class QueueResume(Wire):
    """The operator's consent that the queue moves the arm. A real arm requires `moves_real_arm`."""

    moves_real_arm: StrictBool = False


class Control(Wire):
    """Who may move the robot now: nobody, one client or, during an experiment, the queue."""

    holder: Literal["nobody", "client", "queue"]
    name: str | None = None
    """Name of the client."""
    expires: AwareDatetime | None = None
    remaining: float | None = None
    """Time (s) until control ends without a heartbeat."""


class ControlRequest(Wire):
    """Requests control of the robot. A real arm requires the operator's consent: `moves_real_arm`."""

    moves_real_arm: StrictBool = False


class ControlLease(Wire):
    """Control of the robot for one client. `lease` is its secret, which the client sends with every motion and
    heartbeat in the header `Control-Lease`."""

    lease: str
    expires: AwareDatetime
    remaining: float
    heartbeat_every: float
    """Time (s) within which the client should renew it."""
