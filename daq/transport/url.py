"""Parses port URLs, which name the way to a controller. Pure; each mistake gets a one-line error.

serial:///dev/ttyUSB0?baud=115200
serial:///dev/ttyUSB0?baud=1000000&dialect=dynamixel&ids=1,2
tcp://192.168.1.20:4000
mock://?lock_step=1&seed=3&fault=flip:rate=0.01
mock://?dialect=dynamixel&ids=1,2
lerobot:so101_follower?port=/dev/ttyACM0  (a Python driver, by the scheme of its plug-in)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl, quote, unquote, urlsplit

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.plugins import plugins

DEFAULT_BAUD = 115200
"""Line rate without `baud` in the URL (bits per second; ten bits per byte)."""
BAUD_RATES = (
    *(1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400),
    *(250000, 460800, 500000, 921600, 1000000),  # of these, a clock of 16 MHz gives 250000, 500000, 1000000 exactly
    *(2000000, 3000000, 4000000),
)
BITS_PER_BYTE = 10
"""Bits that a byte takes on the line: start bit, eight data bits, stop bit."""
FRAMED = "framed"
"""The dialect of PROTOCOL.md, used if the URL names none."""
SERVOS = "dynamixel"
"""The dialect with a separate mock."""


class TransportError(DaqError):
    """A port cannot be named, found, opened or owned."""

    exit_code = exit_codes.NOT_REACHED


class PortBusyError(TransportError):
    """Another program uses the port."""


class PortUrlError(TransportError):
    """A port URL is invalid."""

    exit_code = exit_codes.WRONG_INPUT


@dataclass(frozen=True)
class SerialPort:
    """A serial port or pseudo-terminal of this machine."""

    device: str
    baud: int = DEFAULT_BAUD
    dialect: str = FRAMED
    ids: tuple[int, ...] = ()
    """IDs on the bus of joints 1, 2, …, for dialects that need them."""


@dataclass(frozen=True)
class TcpPort:
    """A bridge behind a TCP server. `baud`: rate of the serial line behind it, which determines time-outs."""

    host: str
    port: int
    baud: int = DEFAULT_BAUD
    lock_step: bool = False
    dialect: str = FRAMED
    ids: tuple[int, ...] = ()


@dataclass(frozen=True)
class MockPort:
    """A mock controller that is started for this connection and ends with it.

    `arguments`: its command-line arguments, except the address. With a `baud` in the URL, its bytes take as long as on
    a serial line.
    """

    arguments: tuple[str, ...] = ()
    baud: int = DEFAULT_BAUD
    lock_step: bool = False
    through_pty: bool = False
    dialect: str = FRAMED
    ids: tuple[int, ...] = ()


@dataclass(frozen=True)
class DriverPort:
    """A robot with a Python driver of a plug-in. `target` and `options` are the driver's own."""

    scheme: str
    target: str
    options: tuple[tuple[str, str], ...] = ()
    baud: int = DEFAULT_BAUD
    dialect: str = "python"
    ids: tuple[int, ...] = ()


PortUrl = SerialPort | TcpPort | MockPort | DriverPort

_DIALECT_OPTIONS = ("dialect", "ids")
_SERIAL_OPTIONS = ("baud", *_DIALECT_OPTIONS)
_TCP_OPTIONS = ("baud", "lock_step", *_DIALECT_OPTIONS)
MOCK_FLAGS = ("lock_step", "no_sample", "no_compact", "pty")
"""Options of mock:// that are on (1) or off (0)."""
MOCK_VALUES = (
    "baud",
    "seed",
    "start",
    "gains",
    "memory_map",
    "secret_map",
    "secret_sensors",
    "documented",
    "plant",
    "board",
    "modify",
    "secret",
    "fault",
)
"""Options of mock:// that are passed to the mock with their value."""
REPEATABLE = ("modify", "fault")
SERVO_VALUES = ("ids", "supply", "load", "coulomb", "secret")
"""Options of mock://?dialect=dynamixel that are passed to the mock of servos with their value."""


def serial_url(device: str) -> str:
    """Returns the URL of a serial device at this path."""
    return f"serial://{quote(device)}"


def parse_port_url(text: str) -> PortUrl:
    """Returns the port that a URL names. Raises TransportError with one line: what is wrong and what is allowed."""
    scheme = text.partition(":")[0]
    drivers = {name for plugin in plugins() for name in plugin.drivers}
    if "://" not in text and scheme not in drivers:
        hint = f"; for a device write {serial_url(text)}" if text.startswith("/") else ""
        raise PortUrlError(f"port {text!r}: must begin with serial://, tcp:// or mock://{hint}")
    try:
        parts = urlsplit(text)
        options = parse_qsl(parts.query, keep_blank_values=True)
    except ValueError as error:
        raise PortUrlError(f"port {text!r}: no URL: {error}") from error
    if scheme in drivers:
        known = tuple(name for name, _ in options)
        given = _single(text, options, known)
        return DriverPort(scheme, (parts.netloc + parts.path).strip("/"), tuple(given.items()))
    if parts.scheme == "serial":
        return _serial(text, unquote(parts.netloc + parts.path), _single(text, options, _SERIAL_OPTIONS))
    if parts.scheme == "tcp":
        return _tcp(text, parts.netloc, parts.path, _single(text, options, _TCP_OPTIONS))
    if parts.scheme == "mock":
        if parts.netloc or parts.path not in ("", "/"):
            raise PortUrlError(f"port {text!r}: mock:// takes no address, only options after '?'")
        return _mock_servos(text, options) if ("dialect", SERVOS) in options else _mock(text, options)
    others = f", or of a driver: {', '.join(sorted(drivers))}" if drivers else ""
    raise PortUrlError(f"port {text!r}: scheme {parts.scheme!r} is unknown: serial, tcp or mock{others}")


def _single(text: str, options: list[tuple[str, str]], known: tuple[str, ...]) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in options:
        _check_known(text, name, known)
        if name in found:
            raise PortUrlError(f"port {text!r}: option {name!r} is given twice")
        found[name] = value
    return found


def _check_known(text: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise PortUrlError(f"port {text!r}: unknown option {name!r}: allowed are {', '.join(known)}")


def _serial(text: str, device: str, options: Mapping[str, str]) -> SerialPort:
    if not device.startswith("/") or device == "/":
        raise PortUrlError(f"port {text!r}: needs a device with its path, as in serial:///dev/ttyUSB0")
    return SerialPort(device, _baud(text, options), *_dialect(text, options))


def _tcp(text: str, address: str, path: str, options: Mapping[str, str]) -> TcpPort:
    host, _, port = address.rpartition(":")
    if not host or path not in ("", "/"):
        raise PortUrlError(f"port {text!r}: needs a host and a port number, as in tcp://127.0.0.1:4000")
    if not (port.isdecimal() and len(port) <= 5 and 1 <= int(port) <= 65535):
        raise PortUrlError(f"port {text!r}: port number {port!r}: allowed are 1 to 65535")
    lock_step = _flag(text, "lock_step", options.get("lock_step"))
    return TcpPort(host.strip("[]"), int(port), _baud(text, options), lock_step, *_dialect(text, options))


def _mock(text: str, options: list[tuple[str, str]]) -> MockPort:
    for name, _ in options:
        _check_known(text, name, MOCK_FLAGS + MOCK_VALUES)
    once = _single(text, [option for option in options if option[0] not in REPEATABLE], MOCK_FLAGS + MOCK_VALUES)
    flags = {name: _flag(text, name, once.get(name)) for name in MOCK_FLAGS}
    if "seed" in once and not once["seed"].isdecimal():
        raise PortUrlError(f"port {text!r}: seed {once['seed']!r}: must be a whole number, 0 or more")
    arguments = [f"--{name.replace('_', '-')}" for name in ("lock_step", "no_sample", "no_compact") if flags[name]]
    for name, value in options:
        if name in MOCK_VALUES:
            if not value:
                raise PortUrlError(f"port {text!r}: option {name!r} needs a value")
            arguments += [f"--{name.replace('_', '-')}", value]
    return MockPort(tuple(arguments), _baud(text, once), flags["lock_step"], flags["pty"])


def _mock_servos(text: str, options: list[tuple[str, str]]) -> MockPort:
    given = _single(text, options, ("dialect", "baud", "pty", *SERVO_VALUES))
    dialect, ids = _dialect(text, given)
    arguments = [f"--{name}={given[name]}" for name in SERVO_VALUES if name in given]
    arguments.append("--torque")  # nobody could switch the torque on: this mock ends with its first connection
    through_pty = _flag(text, "pty", given.get("pty"))
    return MockPort(tuple(arguments), _baud(text, given), through_pty=through_pty, dialect=dialect, ids=ids)


def _dialect(text: str, options: Mapping[str, str]) -> tuple[str, tuple[int, ...]]:
    """Returns the dialect, and the joints' IDs on its bus."""
    dialect, ids = options.get("dialect", FRAMED), options.get("ids", "")
    numbers = ids.split(",") if ids else []
    if not all(number.isdecimal() and len(number) <= 5 for number in numbers):
        raise PortUrlError(f"port {text!r}: ids {ids!r}: write whole numbers in the order of the joints, as in ids=1,2")
    if dialect == SERVOS and not numbers:
        raise PortUrlError(f"port {text!r}: needs the servos' IDs in the order of the joints, as in ids=1,2")
    return dialect, tuple(map(int, numbers))


def _baud(text: str, options: Mapping[str, str]) -> int:
    baud = options.get("baud", str(DEFAULT_BAUD))
    if baud not in map(str, BAUD_RATES):
        allowed = ", ".join(str(rate) for rate in BAUD_RATES)
        raise PortUrlError(f"port {text!r}: baud {baud!r}: allowed are {allowed}")
    return int(baud)


def _flag(text: str, name: str, value: str | None) -> bool:
    if value not in (None, "0", "1"):
        raise PortUrlError(f"port {text!r}: {name} {value!r}: allowed are 0 and 1")
    return value == "1"
