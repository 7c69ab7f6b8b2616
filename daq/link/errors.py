"""Errors of a transaction."""

from __future__ import annotations

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from firmware_protocol.commands import Refusal


class LinkError(DaqError):
    """The controller cannot be reached."""

    exit_code = exit_codes.NOT_REACHED
    sent = False
    """Whether the request was written before it failed, so that it may have been carried out."""


class LinkTimeoutError(LinkError):
    """A request got no reply, even after all repetitions."""


class LinkLostError(LinkError):
    """The channel has ended; no request is sent until `Link.reconnect` has succeeded."""


class StopCameFirstError(DaqError):
    """A stop was written after the request was checked. The request was not written."""

    exit_code = exit_codes.NOT_REACHED

    def __init__(self) -> None:
        super().__init__("a stop came first: look at the arm, then try again")


class RequestRefusedError(DaqError):
    """The controller refused the request. Nothing has changed there."""

    exit_code = exit_codes.NOT_REACHED

    def __init__(self, request: str, reason: int, why: str = "") -> None:
        self.request = request
        self.reason = reason
        if reason == Refusal.NOT_CAPABLE and request in _BY_THE_MAP:
            why = why or "its bridge's memory map lacks the registers for it (docs/commissioning.md)"
        why = why or _EXPLANATION.get(reason, f"unknown reason {reason}")
        super().__init__(f"the controller refused {request}: {why}")


_BY_THE_MAP = ("ReportGains", "SetGains", "ReadProcess", "WriteOutputs", "SetGripper")
"""Requests that a bridge cannot carry out if its memory map lacks their registers."""
_EXPLANATION: dict[int, str] = {
    Refusal.UNKNOWN_OPCODE: "it does not know this request",
    Refusal.BAD_LENGTH: "the request has a wrong length",
    Refusal.BAD_ADDRESS: "the address lies outside its shared memory",
    Refusal.BAD_VALUE: "a value is out of range",
    Refusal.NOT_CAPABLE: "its bridge cannot do this",
    Refusal.FROZEN: "it has been stopped and holds its posture until it is released",
    Refusal.NOTHING_NEW: "there is nothing new",
    Refusal.BAD_SESSION: "the session has ended: the controller has restarted, or another host has taken "
    "control; connect again, or reset",
    Refusal.OTHER_STOP: "a newer stop is in force",
    Refusal.UNFIT: "it cannot be driven in its present state",
    Refusal.STALE: "a later command, possibly a stop, was already carried out",
}
