"""The numbers with a meaning: capabilities, status flags, reasons of refusal."""

from enum import IntEnum, IntFlag

PROTOCOL_VERSION = 2
NO_SESSION = 0
"""In place of a session's number: there is none. No bridge gives it to a session."""


class Capability(IntFlag):
    """What a bridge can do beyond reading and writing the shared memory."""

    SAMPLE = 1
    """Sees the controller's period and keeps a ring of consistent snapshots."""
    LOCK_STEP = 2
    """Its time stands still until the host asks for more (`Advance`, or `Sample` of a tick not yet made)."""
    SIMULATED = 4
    """No arm behind it."""


class StatusFlag(IntFlag):
    """State of the board, in every snapshot."""

    FROZEN = 1
    """Stopped: set points are held at the posture where the stop found the arm, until `Release`."""
    RESTARTED = 2
    """The board has been reset since the last `Hello` that began a session; commands are refused until the next."""
    SET_POINT_MISSED = 4
    """In this period the controller wanted the memory while the host had it, and took no set points."""


class Refusal(IntEnum):
    """Why a request was not carried out."""

    UNKNOWN_OPCODE = 1
    BAD_LENGTH = 2
    BAD_ADDRESS = 3
    BAD_VALUE = 4
    NOT_CAPABLE = 5
    FROZEN = 6
    NOTHING_NEW = 7
    """The controller has begun no new period for so long that waiting on is of no use."""
    STALE = 8
    """A command that arrived after a later one: obeying it would undo the later one."""
    BAD_SESSION = 9
    """A command of no session, or of one that has ended: recorded, delayed, or of a host that another has replaced."""
    OTHER_STOP = 10
    """A `Release` that names a stop which is not the newest: the newest one holds."""
