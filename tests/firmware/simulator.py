"""The Mega's firmware image on a simulated ATmega2560, as a shared library."""

import ctypes
from collections.abc import Callable
from pathlib import Path

CLOCKS_PER_US = 16
RULES = (
    "1MHzE has a period of 1 us, half of it high",
    "NPGFC falls 250 ns before 1MHzE rises",
    "address and R/W stand 300 ns before 1MHzE rises",
    "address, R/W and NPGFC stand 30 ns after 1MHzE falls",
    "data to be written stand 150 ns after 1MHzE has risen",
    "data to be written stand 50 ns after 1MHzE falls",
    "NPGFC is low in one high half of 1MHzE",
    "the data lines are left alone while they are read",
)
_READ = ctypes.CFUNCTYPE(ctypes.c_uint8, ctypes.c_uint16, ctypes.c_uint64)
_WRITE = ctypes.CFUNCTYPE(None, ctypes.c_uint16, ctypes.c_uint8, ctypes.c_uint64)
_ROOM = 4096


class BusReport(ctypes.Structure):
    """What the model of the bus has seen: accesses, broken rules, and the tightest moments (ns)."""

    _fields_ = (
        ("reads", ctypes.c_uint32),
        ("writes", ctypes.c_uint32),
        ("faults", ctypes.c_uint32 * len(RULES)),
        ("least_select_setup_ns", ctypes.c_int32),
        ("least_address_setup_ns", ctypes.c_int32),
        ("least_hold_ns", ctypes.c_int32),
        ("least_data_hold_ns", ctypes.c_int32),
    )

    @property
    def broken(self) -> dict[str, int]:
        """Rules that were broken, and how often."""
        return {rule: count for rule, count in zip(RULES, self.faults, strict=True) if count}


class Simulator:
    """One simulated board, running an image from its reset on; `read` and `write` get the moment in clocks."""

    def __init__(
        self, library: Path, image: Path, read: Callable[[int, int], int], write: Callable[[int, int, int], None]
    ) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.simulator_clock.restype = ctypes.c_uint64
        self._library.simulator_bus_report.restype = ctypes.POINTER(BusReport)
        self._callbacks = (_READ(read), _WRITE(write))
        self._room = ctypes.create_string_buffer(_ROOM)
        if self._library.simulator_start(str(image).encode(), *self._callbacks) != 0:
            raise ValueError(f"{image}: not an image for this board")

    @property
    def clock(self) -> int:
        """Clocks of 62.5 ns since the start."""
        return int(self._library.simulator_clock())

    def run(self, clock: int) -> None:
        """Runs the processor up to a clock."""
        if self._library.simulator_run(ctypes.c_uint64(clock)) != 0:
            raise ValueError("the firmware has crashed")

    def reset(self) -> None:
        """Presses the reset button: the EEPROM is kept."""
        self._library.simulator_reset()

    def take(self, data: bytes) -> int:
        """Bytes for the UART; how many it took."""
        return int(self._library.simulator_take(data, len(data)))

    def give(self) -> bytes:
        """Bytes from the UART."""
        given: int = self._library.simulator_give(self._room, _ROOM)
        return self._room.raw[:given]

    @property
    def bus(self) -> BusReport:
        """What the bus has seen so far."""
        report: BusReport = self._library.simulator_bus_report().contents
        return report

    @property
    def stack_bytes(self) -> int:
        """Bytes of the stack that have been used at most."""
        return int(self._library.simulator_stack_bytes())
