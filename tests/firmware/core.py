"""The bridge's core in C, as a shared library: bytes in, bytes out, on a memory and a clock of Python."""

import ctypes
from collections.abc import Callable
from enum import IntEnum
from pathlib import Path

_READ = ctypes.CFUNCTYPE(ctypes.c_uint8, ctypes.c_uint16)
_WRITE = ctypes.CFUNCTYPE(None, ctypes.c_uint16, ctypes.c_uint8)
_CLOCK = ctypes.CFUNCTYPE(ctypes.c_uint32)
_ROOM = 4096


class PeriodSource(IntEnum):
    """How the core learns of the controller's periods: `enum period_source` of core.h."""

    UNSEEN = 0
    WATCHED = 1
    TOLD = 2


class Core:
    """The one core of the library, started anew."""

    def __init__(
        self,
        library: Path,
        read: Callable[[int], int],
        write: Callable[[int, int], None],
        time_us: Callable[[], int],
        source: PeriodSource,
    ) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.bridge_wants_byte.restype = ctypes.c_bool
        self._library.bridge_is_frozen.restype = ctypes.c_bool
        self._library.bridge_newest_number.restype = ctypes.c_uint32
        self._callbacks = (_READ(read), _WRITE(write), _CLOCK(time_us))
        self._source = source
        self._room = ctypes.create_string_buffer(_ROOM)

    def start(self, first_number: int, *, frozen: bool = False) -> None:
        """Starts the bridge, or starts it again."""
        number = ctypes.c_uint32(first_number)
        self._library.hosted_start(*self._callbacks, int(self._source), int(frozen), number)

    def take(self, data: bytes) -> int:
        """Hands over bytes of the host's while the bridge wants them; how many it took."""
        taken: int = self._library.hosted_take(data, len(data))
        return taken

    def give(self) -> bytes:
        """The bytes for the host."""
        given: int = self._library.hosted_give(self._room, _ROOM)
        return self._room.raw[:given]

    def work(self) -> None:
        """What time asks for."""
        self._library.bridge_work()

    def period_ended(self) -> None:
        """The controller has stored a period's results (PeriodSource.TOLD)."""
        self._library.bridge_period_ended()

    def hang_up(self) -> None:
        """The connection has ended."""
        self._library.bridge_hang_up()

    @property
    def frozen(self) -> bool:
        """Whether set points are held."""
        return bool(self._library.bridge_is_frozen())

    @property
    def newest_number(self) -> int:
        """The newest number given to a session or a stop."""
        return int(self._library.bridge_newest_number())

    def crc_of(self, data: bytes) -> int:
        """CRC-16 of up to 255 bytes."""
        self._library.crc_of.restype = ctypes.c_uint16
        return int(self._library.crc_of(data, ctypes.c_uint8(len(data))))

    def stuff(self, body: bytes) -> bytes:
        """A body with its zeros replaced."""
        piece = ctypes.create_string_buffer(b"\0" + body, len(body) + 1)
        self._library.stuff(piece, ctypes.c_uint8(len(piece)))
        return piece.raw

    def unstuff(self, piece: bytes) -> bytes | None:
        """The body again; None for broken stuffing."""
        body = ctypes.create_string_buffer(piece, max(len(piece), 1))
        self._library.unstuff.restype = ctypes.c_uint8
        count = int(self._library.unstuff(body, ctypes.c_uint8(len(piece))))
        return body.raw[:count] if count else None
