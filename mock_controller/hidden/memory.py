"""A shared memory drawn from a seed: the address of each register, and the other contents.

Registers lie in rows, side by side or anywhere; a value of two bytes has its halves side by side, in either order, or
apart. Other contents of such a controller's page are drawn too: constants, counters, noise, and quantities that look
like a register of the host but are none. The meaning of a value (unit, sign, rounding) is never drawn: a memory map may
move registers, but not change their meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any, Literal

from firmware_protocol.memory_map import JOINTS, MemoryMap, default_memory_map
from firmware_protocol.units import POSTURE_UNITS, posture_to_counts
from mock_controller.board.board import Board
from mock_controller.board.snapshot import PeriodSnapshot

Documented = Literal["kept", "moved"]
"""Whether the six documented positions lie where the source has them."""
Pairs = list[tuple[int, int]]

_NEVER_CHANGED = ("gain_p", "gain_i", "gain_d", "process_inputs", "process_outputs", "gripper")
"""Registers that the controller never changes by itself: readings hardly prove where they are."""
_KEPT = 1 / 3
"""Share of memories with these at the shipped map's addresses."""
_ROW = 8
"""Bytes from a row of low bytes to its row of high bytes, as in the documented positions."""


@dataclass(frozen=True)
class OtherRegister:
    """A content of the page that is not for the host: `kind` names it, `value` gives its bytes after a period."""

    kind: str
    addresses: tuple[int, ...]
    value: Callable[[PeriodSnapshot, PeriodSnapshot | None], Sequence[int]] = field(repr=False)

    changes: bool = True

    def pairs(self, now: PeriodSnapshot, before: PeriodSnapshot | None) -> Pairs:
        """Returns (address, byte) pairs after the period `now`, which followed `before`."""
        return [(address, value & 0xFF) for address, value in zip(self.addresses, self.value(now, before), strict=True)]


@dataclass(frozen=True)
class HiddenMemory:
    """A memory with all its contents. `flags` are the four upper bits that position's high bytes carry, by joint."""

    seed: int
    map: MemoryMap
    gains: tuple[tuple[int, int, int], ...]
    flags: tuple[int, ...]
    others: tuple[OtherRegister, ...]

    def truth(self) -> dict[str, Any]:
        """Returns all secrets, as JSON data."""
        return {
            "seed": self.seed,
            "registers": {
                name: {"bits": register.bits, "low": list(register.low), "high": list(register.high or ())}
                for name, register in self.map.registers.items()
            },
            "gains": [list(gains) for gains in self.gains],
            "others": [{"kind": other.kind, "addresses": list(other.addresses)} for other in self.others],
        }


class _Page:
    """Free addresses of the page, handed out in blocks."""

    def __init__(self, random: Random, base: int, size: int) -> None:
        self._random = random
        self._free = set(range(base, base + size))

    def take(self, addresses: Sequence[int]) -> bool:
        """Reserves these addresses; returns False if one is not free."""
        if not self._free.issuperset(addresses):
            return False
        self._free.difference_update(addresses)
        return True

    def give_back(self, addresses: Sequence[int]) -> None:
        """Frees these addresses."""
        self._free.update(addresses)

    def anywhere(self, count: int) -> list[int]:
        """Returns any `count` free addresses, in any order."""
        chosen = self._random.sample(sorted(self._free), count)
        self._free.difference_update(chosen)
        return chosen

    def shaped(self, offsets: Sequence[int]) -> list[int]:
        """Returns free addresses at these offsets from a random place; anywhere, if the shape no longer fits."""
        places = [place for place in sorted(self._free) if self._free.issuperset(place + o for o in offsets)]
        if not places:
            return self.anywhere(len(offsets))
        place = self._random.choice(places)
        chosen = [place + offset for offset in offsets]
        self._free.difference_update(chosen)
        return chosen

    @property
    def left(self) -> int:
        return len(self._free)


def draw_memory(seed: int, documented: Documented = "kept") -> HiddenMemory:
    """Returns the memory of a seed."""
    random = Random(f"hidden memory {seed} {documented}")
    shipped = default_memory_map()
    page = _Page(random, shipped.base, shipped.size)
    columns: dict[str, tuple[list[int], list[int] | None]] = {}
    bits = {"set_point": 10, "position": 12, "error": random.choice((8, 12, 16)), "power": 8}
    columns["position"] = _positions(random, page, documented)
    kept = {name: list(shipped[name].low) for name in _NEVER_CHANGED}
    if random.random() < _KEPT and page.take([address for column in kept.values() for address in column]):
        columns |= {name: (column, None) for name, column in kept.items()}
    for name in random.sample(("set_point", "error"), 2):
        columns[name] = _two_bytes(random, page) if bits[name] > 8 else (_one_byte(random, page), None)
    columns["power"] = _one_byte(random, page), None
    if "gain_p" not in columns:
        for name, column in zip(("gain_p", "gain_i", "gain_d"), _gain_columns(random, page), strict=True):
            columns[name] = column, None
        for name in ("process_inputs", "process_outputs", "gripper"):
            columns[name] = page.anywhere(1), None
    registers = {}
    for name, register in shipped.registers.items():
        low, high = columns[name]
        where = {
            "low": tuple(low),
            "high": None if high is None else tuple(high),
            "bits": bits.get(name, register.bits),
        }
        registers[name] = register.model_copy(update={**where, "provenance": ("assumed",) * len(low)})
    memory_map = MemoryMap(version=1, name=f"secret {seed}", base=shipped.base, size=shipped.size, registers=registers)
    p = [random.choice((2, 2, 3)) for _ in range(JOINTS)] if random.random() < 0.5 else [2] * JOINTS
    flags = [0] * JOINTS if random.random() < 0.6 else [random.randrange(16) for _ in range(JOINTS)]
    return HiddenMemory(seed, memory_map, tuple((g, 0, 0) for g in p), tuple(flags), _others(random, page))


def _positions(random: Random, page: _Page, documented: Documented) -> tuple[list[int], list[int]]:
    shipped = default_memory_map()["position"]
    assert shipped.high is not None
    if documented == "moved":
        avoided = [*shipped.low[:3], *shipped.high[:3]]
        page.take(avoided)
        moved = _two_bytes(random, page)
        page.give_back(avoided)
        return moved
    low, high = list(shipped.low[:3]), list(shipped.high[:3])
    page.take(low + high)
    if random.random() < 0.5 and page.take([*shipped.low[3:], *shipped.high[3:]]):
        return [*low, *shipped.low[3:]], [*high, *shipped.high[3:]]
    rest = page.anywhere(6)
    return low + rest[:3], high + rest[3:]


def _one_byte(random: Random, page: _Page) -> list[int]:
    style = random.choice(("row", "apart", "anywhere"))
    if style == "row":
        return page.shaped(range(JOINTS))
    return page.shaped(range(0, 2 * JOINTS, 2)) if style == "apart" else page.anywhere(JOINTS)


def _two_bytes(random: Random, page: _Page) -> tuple[list[int], list[int]]:
    """Returns addresses of low and high bytes of six joints."""
    style = random.choice(("rows", "little", "big", "anywhere"))
    if style == "rows":
        found = page.shaped([*range(JOINTS), *range(_ROW, _ROW + JOINTS)])
        first, second = found[:JOINTS], found[JOINTS:]
        return (first, second) if random.random() < 0.7 else (second, first)
    if style == "anywhere":
        found = page.anywhere(2 * JOINTS)
        return found[:JOINTS], found[JOINTS:]
    found = page.shaped(range(2 * JOINTS))
    first, second = found[::2], found[1::2]
    return (first, second) if style == "little" else (second, first)


def _gain_columns(random: Random, page: _Page) -> list[list[int]]:
    style = random.choice(("rows", "records", "anywhere"))
    if style == "rows":
        found = page.shaped([8 * row + joint for row in range(3) for joint in range(JOINTS)])
    elif style == "records":
        found = page.shaped([3 * joint + row for row in range(3) for joint in range(JOINTS)])
    else:
        found = page.anywhere(3 * JOINTS)
    return [found[row * JOINTS : (row + 1) * JOINTS] for row in range(3)]


# --- other contents of the page


def _others(random: Random, page: _Page) -> tuple[OtherRegister, ...]:
    """Fills the page, except for a few bytes that stay zero."""
    others: list[OtherRegister] = []
    empty = random.randrange(4)
    while page.left > empty:
        maker, size = random.choice(_MAKERS)
        if size <= page.left - empty:
            others.append(maker(random, tuple(page.anywhere(size))))
    return tuple(others)


def _constant(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    value = random.choice((0, 0, 2, random.randrange(256), random.randrange(256)))
    return OtherRegister("constant", addresses, lambda _now, _before: (value,), changes=False)


def _counter(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    step, start = random.choice((1, 1, 2, 5, -1)), random.randrange(256)
    return OtherRegister("counter", addresses, lambda now, _before: (start + step * now.tick,))


def _long_counter(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    divisor, start = random.choice((1, 1, 5, 50)), random.randrange(65536)

    def value(now: PeriodSnapshot, _before: PeriodSnapshot | None) -> tuple[int, int]:
        count = start + now.tick // divisor
        return count, count >> 8

    return OtherRegister("long counter", addresses, value)


def _noise(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    own, most = Random(random.getrandbits(64)), random.choice((3, 31, 255))
    return OtherRegister("noise", addresses, lambda _now, _before: (own.randint(0, most),))


def _drift(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    own, state = Random(random.getrandbits(64)), [random.randrange(60, 200)]

    def value(now: PeriodSnapshot, _before: PeriodSnapshot | None) -> tuple[int]:
        if now.tick % 25 == 0:
            state[0] += own.choice((-1, 0, 1))
        return (state[0],)

    return OtherRegister("drift", addresses, value)


def _target(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    joint = random.randrange(JOINTS)

    def value(now: PeriodSnapshot, _before: PeriodSnapshot | None) -> tuple[int, int]:
        counts = posture_to_counts(min(now.set_points[joint], POSTURE_UNITS - 1))
        return counts, counts >> 8

    return OtherRegister(f"set point {joint + 1} in counts", addresses, value)


def _last_error(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    joint = random.randrange(JOINTS)

    def value(now: PeriodSnapshot, before: PeriodSnapshot | None) -> tuple[int]:
        return (min(max((before or now).errors[joint], -128), 127),)

    return OtherRegister(f"error {joint + 1} of the previous period", addresses, value)


def _last_position(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    joint = random.randrange(JOINTS)

    def value(now: PeriodSnapshot, before: PeriodSnapshot | None) -> tuple[int, int]:
        counts = (before or now).positions[joint]
        return counts, counts >> 8

    return OtherRegister(f"position {joint + 1} of the previous period", addresses, value)


def _coarse_position(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    joint = random.randrange(JOINTS)
    kind = f"position {joint + 1} in 8 bits"
    return OtherRegister(kind, addresses, lambda now, _before: (now.positions[joint] >> 4,))


def _pulse_width(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    joint = random.randrange(JOINTS)
    kind = f"pulse width {joint + 1} and its direction"
    return OtherRegister(kind, addresses, lambda now, _before: (abs(now.powers[joint]), int(now.powers[joint] < 0)))


def _saturated(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    del random

    def value(now: PeriodSnapshot, _before: PeriodSnapshot | None) -> tuple[int]:
        return (sum((abs(power) >= 127) << joint for joint, power in enumerate(now.powers)),)

    return OtherRegister("joints at their limit", addresses, value)


def _sum(random: Random, addresses: tuple[int, ...]) -> OtherRegister:
    del random
    return OtherRegister("check sum", addresses, lambda now, _before: (sum(now.positions) + sum(now.errors),))


_MAKERS: tuple[tuple[Callable[[Random, tuple[int, ...]], OtherRegister], int], ...] = (
    *(((_constant, 1),) * 8),
    *(((_counter, 1),) * 2),
    *(((_long_counter, 2),) * 2),
    *(((_noise, 1),) * 2),
    (_drift, 1),
    (_target, 2),
    (_last_error, 1),
    (_last_position, 2),
    (_coarse_position, 1),
    (_pulse_width, 2),
    (_saturated, 1),
    (_sum, 1),
)
"""Possible contents of one or two bytes, repeated by likelihood."""


# --- A board whose memory follows a secret map, with other registers between those of the host


class SecretBoard(Board):
    """A `Board` with a secret memory; other arguments are those of `Board`."""

    def __init__(self, secret: HiddenMemory, *arguments: Any, **options: Any) -> None:
        self._secret = secret
        self._before: PeriodSnapshot | None = None
        high = secret.map["position"].high or ()
        self._changing = [other for other in secret.others if other.changes]
        self._flags = {address: flags << 4 for address, flags in zip(high, secret.flags, strict=True)}
        super().__init__(*arguments, **options)

    def _to_publish(self, results: PeriodSnapshot) -> list[tuple[int, int]]:
        own = [(address, value | self._flags.get(address, 0)) for address, value in super()._to_publish(results)]
        # Constants are stored only once, in the first period after power-up.
        stored = self._changing if results.tick > 1 else self._secret.others
        others = [pair for other in stored for pair in other.pairs(results, self._before)]
        self._before = results
        return own + others
