"""The shared memory as data: the address, unit and source of every register."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Annotated, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from firmware_protocol.errors import MemoryMapError, UnitsError
from firmware_protocol.invalid import first_invalid

JOINTS = 6
"""Number of joints that the controller drives (section 6.2)."""

Provenance = Literal["documented", "found", "assumed"]
"""Origin of an address: the source, evidence from the machine itself (`daq memory find`), or an assumption."""
Unit = Literal["posture_unit", "adc_count", "dac_count", "gain", "bit_field", "on_off"]
Address = Annotated[int, Field(ge=0, le=0xFFFF)]
Addresses = Annotated[tuple[Address, ...], Field(strict=False)]
"""TOML has arrays where Python has tuples; the elements stay strictly checked."""

PER_JOINT_REGISTERS = ("set_point", "position", "error", "power", "gain_p", "gain_i", "gain_d")
SINGLE_REGISTERS = ("process_inputs", "process_outputs", "gripper")
GAIN_REGISTERS = ("gain_p", "gain_i", "gain_d")
"""A map has all of them or none. Without them the bridge refuses to read and write gains."""
MAY_BE_ABSENT = (*GAIN_REGISTERS, *SINGLE_REGISTERS)
"""Registers that a map may leave out, if their addresses are unknown. They are neither read nor written: without one of
`SINGLE_REGISTERS` the bridge refuses all process requests."""


class Kind(NamedTuple):
    """Use of a register by driver and controller. A memory map may move a register but not change its use."""

    unit: Unit
    signed: bool
    least_bits: int
    most_bits: int


KINDS = {
    "set_point": Kind("posture_unit", False, 10, 16),
    "position": Kind("adc_count", False, 12, 12),
    "error": Kind("adc_count", True, 8, 16),
    "power": Kind("dac_count", True, 8, 8),
    "gain_p": Kind("gain", False, 5, 8),
    "gain_i": Kind("gain", False, 5, 8),
    "gain_d": Kind("gain", False, 5, 8),
    "process_inputs": Kind("bit_field", False, 1, 8),
    "process_outputs": Kind("bit_field", False, 1, 8),
    "gripper": Kind("on_off", False, 1, 1),
}


class Register(BaseModel):
    """One quantity of the shared memory, for every joint or once.

    Element i of `low`, `high` and `provenance` belongs to joint i+1. A value of up to 8 bits has no `high`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    unit: Unit
    bits: Annotated[int, Field(ge=1, le=16)]
    signed: bool
    access: Literal["read", "read_write"]
    low: Addresses
    high: Addresses | None = None
    provenance: Annotated[tuple[Provenance, ...], Field(strict=False)]
    note: str = ""

    @model_validator(mode="after")
    def _bytes_fit_bits(self) -> Register:
        if (self.high is not None) != (self.bits > 8):
            raise ValueError(f"{self.bits} bits need {'a' if self.bits > 8 else 'no'} high byte")
        for name, values in (("high", self.high), ("provenance", self.provenance)):
            if values is not None and len(values) != len(self.low):
                raise ValueError(f"{name} has {len(values)} entries, low has {len(self.low)}")
        return self

    @property
    def addresses(self) -> tuple[int, ...]:
        """Every byte address of this register, low bytes first."""
        return self.low + (self.high or ())

    def decode(self, low: int, high: int = 0) -> int:
        """Returns the integer value of the register's bytes; bits above `bits` are ignored."""
        value = (low | high << 8) & ((1 << self.bits) - 1)
        if self.signed and value >> (self.bits - 1):
            value -= 1 << self.bits
        return value

    def encode(self, value: int) -> tuple[int, int]:
        """Returns low and high byte of a value. Raises UnitsError if the value does not fit the register."""
        lowest = -(1 << (self.bits - 1)) if self.signed else 0
        highest = lowest + (1 << self.bits) - 1
        if not lowest <= value <= highest:
            raise UnitsError(f"value {value} {self.unit}: allowed are {lowest} to {highest}")
        raw = value & (0xFFFF if self.high is not None else 0xFF)
        return raw & 0xFF, raw >> 8


class MemoryMap(BaseModel):
    """All registers of a controller. `base` and `size` bound the memory that may be read or written."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    version: Literal[1]
    name: str
    base: Address
    size: Annotated[int, Field(ge=1, le=0x10000)]
    registers: dict[str, Register]

    @model_validator(mode="after")
    def _consistent(self) -> MemoryMap:
        if self.base + self.size > 0x10000:
            raise ValueError(f"{self.size} bytes from {self.base:04X}: the address space ends at FFFF")
        self._check_names()
        self._check_kinds()
        self._check_addresses()
        return self

    def _check_names(self) -> None:
        for name in (*PER_JOINT_REGISTERS, *SINGLE_REGISTERS):
            if name not in self.registers and name not in MAY_BE_ABSENT:
                raise ValueError(f"register {name} is missing")
        gains = [name for name in GAIN_REGISTERS if name in self.registers]
        if gains and len(gains) < len(GAIN_REGISTERS):
            raise ValueError(f"registers {', '.join(gains)}: give all of {', '.join(GAIN_REGISTERS)}, or none")
        unknown = self.registers.keys() - KINDS.keys()
        if unknown:
            raise ValueError(f"register {min(unknown)} is not one that the protocol knows: {', '.join(KINDS)}")

    def _check_kinds(self) -> None:
        for name, register in self.registers.items():
            kind = KINDS[name]
            count = JOINTS if name in PER_JOINT_REGISTERS else 1
            if len(register.low) != count:
                raise ValueError(f"register {name} has {len(register.low)} addresses, needs {count}")
            if register.unit != kind.unit:
                raise ValueError(f"register {name} in {register.unit}: allowed is {kind.unit}")
            if register.signed != kind.signed:
                raise ValueError(f"register {name} must be {'signed' if kind.signed else 'unsigned'}")
            if not kind.least_bits <= register.bits <= kind.most_bits:
                allowed = f"{kind.least_bits} to {kind.most_bits}"
                raise ValueError(f"register {name} has {register.bits} bits: allowed are {allowed}")

    def _check_addresses(self) -> None:
        owner: dict[int, str] = {}
        last = self.base + self.size - 1
        for name, register in self.registers.items():
            for i, address in enumerate(register.addresses):
                byte = f"{name} {i % JOINTS + 1}" if name in PER_JOINT_REGISTERS else name
                if not self.base <= address <= last:
                    raise ValueError(f"{byte} at {address:04X} lies outside {self.base:04X}–{last:04X}")
                if address in owner:
                    raise ValueError(f"{byte} and {owner[address]} overlap at {address:04X}")
                owner[address] = byte

    def __getitem__(self, name: str) -> Register:
        return self.registers[name]

    @property
    def absent(self) -> tuple[str, ...]:
        """Names of the registers that this map leaves out."""
        return tuple(name for name in MAY_BE_ABSENT if name not in self.registers)

    @property
    def has_gains(self) -> bool:
        """Whether gains can be read and written."""
        return GAIN_REGISTERS[0] in self.registers

    @property
    def has_process(self) -> bool:
        """Whether process signals and gripper can be read and written."""
        return all(name in self.registers for name in SINGLE_REGISTERS)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names like `error 2` of every register with an assumed address."""
        return tuple(
            f"{name} {i + 1}" if len(register.low) > 1 else name
            for name, register in self.registers.items()
            for i, provenance in enumerate(register.provenance)
            if provenance == "assumed"
        )


def open_places(text: str) -> str:
    """Returns what to do with a map's text that still has question marks in place of addresses; empty if it has none.
    Such a text is not TOML."""
    marked = [str(number) for number, line in enumerate(text.splitlines(), 1) if re.search(r"[\[,]\s*\?", line)]
    return f"line {', '.join(marked)}: put an address, as 0xFC40, in place of each question mark" if marked else ""


def parse_memory_map(text: str, origin: str = "memory map") -> MemoryMap:
    """Parses a memory map from TOML text; `origin` names the file in errors.

    Raises MemoryMapError with one line: what is wrong and where.
    """
    try:
        return MemoryMap.model_validate(tomllib.loads(text.removeprefix("\ufeff")))
    except RecursionError:
        raise MemoryMapError(f"{origin}: not a memory map: it is nested too deeply") from None
    except ValidationError as error:
        first = first_invalid(error)
        found = f" (found {first.value!r:.60})" if isinstance(first.value, bool | int | float | str) else ""
        raise MemoryMapError(f"{origin}: {first.where('registers')}: {first.message}{found}") from error
    except ValueError as error:  # invalid TOML, or an integer with thousands of digits
        raise MemoryMapError(f"{origin}: {open_places(text) or f'not TOML: {error}'}") from error


@cache
def default_memory_map() -> MemoryMap:
    """Returns the packaged map: documented positions of joints 1–3, all else assumed."""
    return parse_memory_map(
        resources.files("firmware_protocol").joinpath("memory_map.toml").read_text("utf-8"), "memory_map.toml"
    )


def memory_map_text(memory_map: MemoryMap, remarks: Sequence[str] = ()) -> str:
    """Returns the file of a map: remarks, then every register with the origin of each address."""
    lines = [f"# {remark}" for remark in remarks]
    lines += ["version = 1", f'name = "{memory_map.name}"', f"base = 0x{memory_map.base:04X}"]
    lines.append(f"size = 0x{memory_map.size:02X}")
    for name, register in memory_map.registers.items():
        lines += ["", f"[registers.{name}]", f'unit = "{register.unit}"', f"bits = {register.bits}"]
        lines += [f"signed = {str(register.signed).lower()}", f'access = "{register.access}"']
        lines.append(f"low = {addresses_text(register.low)}")
        if register.high is not None:
            lines.append(f"high = {addresses_text(register.high)}")
        origins = ", ".join(f'"{one}"' for one in register.provenance)
        lines.append(f"provenance = [{origins}]")
    return "\n".join(lines) + "\n"


def addresses_text(addresses: Sequence[int | None]) -> str:
    """Returns a list of addresses as in the file; a question mark for an unknown one."""
    return "[" + ", ".join("?" if address is None else f"0x{address:04X}" for address in addresses) + "]"
