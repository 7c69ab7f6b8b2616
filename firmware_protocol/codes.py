"""Numeric codes: capabilities, status flags, reasons of refusal."""

from enum import IntEnum, IntFlag

PROTOCOL_VERSION = 2
NO_SESSION = 0
"""Session number that means "no session"; no bridge assigns it."""


class Capability(IntFlag):
    """What a bridge can do beyond reading and writing the shared memory."""

    SAMPLE = 1
    """Sees the controller's period and keeps a ring of consistent snapshots."""
    LOCK_STEP = 2
    """Its time stands still until the host asks for more (`Advance`, or `Sample` of a tick not yet made)."""
    SIMULATED = 4
    """There is no arm behind the bridge."""
    COMPACT = 8
    """With SAMPLE: understands `MoveAndSample`, the turn for slow lines."""
    POLLED = 16
    """With SAMPLE, of other dialects: a sample is what is measured when it is asked for; nothing keeps earlier ones."""


class StatusFlag(IntFlag):
    """State of the board, in every snapshot."""

    FROZEN = 1
    """Stopped: set points are held at the posture where the stop found the arm, until `Release`."""
    RESTARTED = 2
    """The board has been reset since the last `Hello` that began a session; commands are refused until the next."""
    SET_POINT_MISSED = 4
    """In this period the host held the memory when the controller needed it, so the controller took no set points."""
    NO_TORQUE = 8
    """Of other dialects: a drive is switched off, and nothing holds its joint."""
    HARDWARE_ERROR = 16
    """Of other dialects: a drive reports that it is damaged, too hot, overloaded or badly supplied."""


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
    """A command that arrived after a later one: obeying it would undo the later one."""
    BAD_SESSION = 9
    """A command without a session or from one that has ended: replayed, delayed, or sent by a host that was
    replaced."""
    OTHER_STOP = 10
    """A `Release` that names a stop which is not the newest: only the newest can be ended."""
    UNFIT = 11
    """Of other dialects: what is behind the line is not in a state in which it can be driven."""
