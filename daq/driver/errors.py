"""Errors of the driver, other than those of the link."""

from __future__ import annotations

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError


class ProtocolVersionError(DaqError):
    """Controller and host do not speak the same protocol."""

    exit_code = exit_codes.NOT_REACHED


class ControllerRestartedError(DaqError):
    """The board has been reset: set points and gains are those of power-up. Nothing goes on until `hello`."""

    exit_code = exit_codes.FAULT


class NoSampleError(DaqError):
    """No consistent reading for many periods."""

    exit_code = exit_codes.NOT_REACHED


class GainsNotTakenError(DaqError):
    """Gains read back differ from those written."""

    exit_code = exit_codes.FAULT


class NotFrozenError(DaqError):
    """The board has not confirmed that it took the measured posture as its set points."""

    exit_code = exit_codes.NOT_REACHED


class HardwareFaultError(DaqError):
    """A drive reports that something is wrong with it, or does not hold its joint any more."""

    exit_code = exit_codes.FAULT
