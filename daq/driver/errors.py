"""What the driver may find beside a link that fails."""

from __future__ import annotations

from daq.contracts.errors import DaqError


class ProtocolVersionError(DaqError):
    """Controller and host do not speak the same protocol."""


class ControllerRestartedError(DaqError):
    """The board has been reset: set points and gains are those of power-up. Nothing goes on until `hello`."""


class NoSampleError(DaqError):
    """No consistent reading for many periods."""


class GainsNotTakenError(DaqError):
    """Gains read back differ from those written."""
