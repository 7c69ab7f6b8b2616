"""How a transaction can fail."""

from __future__ import annotations

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from firmware_protocol.commands import Refusal


class LinkError(DaqError):
    """The controller cannot be spoken to."""

    exit_code = exit_codes.NOT_REACHED
    sent = False
    """Whether the request had been written when it failed, and may have been obeyed."""


class LinkTimeoutError(LinkError):
    """No reply to one request, after all its repetitions."""


class LinkLostError(LinkError):
    """The channel has ended; nothing is asked again until `Link.reconnect` has succeeded."""


class StopCameFirstError(DaqError):
    """A stop was written between the moment of a request's check and its own. It has not been written."""

    exit_code = exit_codes.NOT_REACHED

    def __init__(self) -> None:
        super().__init__("a stop came first: look at the arm, then ask again")


class RequestRefusedError(DaqError):
    """The controller answered that it will not. Nothing has changed there."""

    exit_code = exit_codes.NOT_REACHED

    def __init__(self, request: str, reason: int, why: str = "") -> None:
        self.request = request
        self.reason = reason
        if reason == Refusal.NOT_CAPABLE and request in _BY_THE_MAP:
            why = why or "its bridge's memory map leaves out the registers for it (docs/commissioning.md)"
        why = why or _EXPLANATION.get(reason, f"unknown reason {reason}")
        super().__init__(f"the controller refused {request}: {why}")


_BY_THE_MAP = ("ReportGains", "SetGains", "ReadProcess", "WriteOutputs", "SetGripper")
"""Requests that a bridge cannot carry out where its memory map leaves out their registers."""
_EXPLANATION: dict[int, str] = {
    Refusal.UNKNOWN_OPCODE: "it does not know this request",
    Refusal.BAD_LENGTH: "the request has a wrong length",
    Refusal.BAD_ADDRESS: "the address lies outside its shared memory",
    Refusal.BAD_VALUE: "a value is out of range",
    Refusal.NOT_CAPABLE: "its bridge cannot do this",
    Refusal.FROZEN: "it has been stopped and holds its posture until it is released",
    Refusal.NOTHING_NEW: "there is nothing new",
    Refusal.BAD_SESSION: "the session has ended: the controller has restarted, or another host has taken "
    "the control; connect again, or reset",
    Refusal.OTHER_STOP: "another stop has come meanwhile, and holds",
    Refusal.UNFIT: "it is not in a state in which it can be driven",
    Refusal.STALE: "a later command (a stop, perhaps) has already been obeyed",
}
