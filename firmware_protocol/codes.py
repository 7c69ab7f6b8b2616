"""Numeric codes: capabilities, status flags, reasons of refusal."""

from enum import IntEnum, IntFlag

PROTOCOL_VERSION = 2
NO_SESSION = 0
"""Session number that means "no session"; no bridge assigns it."""


class Capability(IntFlag):
    """Abilities of a bridge beyond reading and writing the shared memory."""

    SAMPLE = 1
    """Detects the controller's period and stores consistent snapshots in a ring buffer."""
    LOCK_STEP = 2
    """Its time stands still until the host requests more (`Advance`, or `Sample` of a future tick)."""
    SIMULATED = 4
    """The bridge has no arm."""
    COMPACT = 8
    """With SAMPLE: supports `MoveAndSample`, the compact request for slow lines."""
    POLLED = 16
    """With SAMPLE, in other dialects: a sample is measured when it is requested; earlier ones are not stored."""


class StatusFlag(IntFlag):
    """State of the board, in every snapshot."""

    FROZEN = 1
    """Stopped: set points are held at the posture at which the stop found the arm, until `Release`."""
    RESTARTED = 2
    """The board was reset since the last `Hello` that began a session; commands are refused until the next one."""
    SET_POINT_MISSED = 4
    """In this period the host held the memory when the controller needed it, so the controller could not read set
    points."""
    NO_TORQUE = 8
    """In other dialects: a drive is switched off, and nothing holds its joint."""
    HARDWARE_ERROR = 16
    """In other dialects: a drive reports that it is damaged, too hot, overloaded or badly supplied."""


class Refusal(IntEnum):
    """Why a request was not carried out."""

    UNKNOWN_OPCODE = 1
    BAD_LENGTH = 2
    BAD_ADDRESS = 3
    BAD_VALUE = 4
    NOT_CAPABLE = 5
    FROZEN = 6
    NOTHING_NEW = 7
    """The controller has begun no new period for so long that further waiting is useless."""
    STALE = 8
    """A command that arrived after a later one: carrying it out would undo the later one."""
    BAD_SESSION = 9
    """A command without a session, or from an ended one: replayed, delayed, or sent by a host that was replaced."""
    OTHER_STOP = 10
    """A `Release` of a stop that is not the newest: only the newest can be ended."""
    UNFIT = 11
    """In other dialects: the device cannot be driven in its present state."""
