"""Errors of the driver, other than those of the link."""

from __future__ import annotations

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError


class ProtocolVersionError(DaqError):
    """Controller and host do not speak the same protocol."""

    exit_code = exit_codes.NOT_REACHED


class ControllerRestartedError(DaqError):
    """The board was reset: set points and gains are those of power-up. Everything is refused until `hello`."""

    exit_code = exit_codes.FAULT


class NoSampleError(DaqError):
    """No consistent reading for many periods."""

    exit_code = exit_codes.NOT_REACHED


class GainsNotTakenError(DaqError):
    """The gains read back differ from the gains written."""

    exit_code = exit_codes.FAULT


class NotFrozenError(DaqError):
    """The board has not confirmed that it took the measured posture as its set points."""

    exit_code = exit_codes.NOT_REACHED


class HardwareFaultError(DaqError):
    """A drive reports a fault, or no longer holds its joint."""

    exit_code = exit_codes.FAULT
