"""The shared memory as data: which register lies where, in which unit, and who says so."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from firmware_protocol.errors import MemoryMapError, UnitsError

JOINTS = 6
"""Joints that the controller serves (section 6.2)."""

Provenance = Literal["documented", "assumed"]
Address = Annotated[int, Field(ge=0, le=0xFFFF)]

PER_JOINT_REGISTERS = ("set_point", "position", "error", "power", "gain_p", "gain_i", "gain_d")
SINGLE_REGISTERS = ("process_inputs", "process_outputs", "gripper")


class Register(BaseModel):
    """One quantity of the shared memory, for every joint or once.

    Element i of `low`, `high` and `provenance` belongs to joint i+1. A value of up to 8 bits has no `high`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    unit: Literal["posture_unit", "adc_count", "dac_count", "gain", "bit_field", "on_off"]
    bits: Annotated[int, Field(ge=1, le=16)]
    signed: bool
    access: Literal["read", "read_write"]
    low: tuple[Address, ...]
    high: tuple[Address, ...] | None = None
    provenance: tuple[Provenance, ...]
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
        """Integer value of the register's bytes; bits above `bits` are ignored unless they carry the sign."""
        value = (low | high << 8) & ((1 << self.bits) - 1)
        if self.signed and value >> (self.bits - 1):
            value -= 1 << self.bits
        return value

    def encode(self, value: int) -> tuple[int, int]:
        """Low and high byte of a value. Raises UnitsError when the value does not fit the register."""
        lowest = -(1 << (self.bits - 1)) if self.signed else 0
        highest = lowest + (1 << self.bits) - 1
        if not lowest <= value <= highest:
            raise UnitsError(f"value {value} {self.unit}: allowed are {lowest} to {highest}")
        raw = value & (0xFFFF if self.high is not None else 0xFF)
        return raw & 0xFF, raw >> 8


class MemoryMap(BaseModel):
    """All registers of a controller. `base` and `size` bound the memory that may be read or written."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Literal[1]
    name: str
    base: Address
    size: Annotated[int, Field(ge=1, le=0x10000)]
    registers: dict[str, Register]

    @model_validator(mode="after")
    def _consistent(self) -> MemoryMap:
        for names, count in ((PER_JOINT_REGISTERS, JOINTS), (SINGLE_REGISTERS, 1)):
            for name in names:
                if name not in self.registers:
                    raise ValueError(f"register {name} is missing")
                if len(self.registers[name].low) != count:
                    found = len(self.registers[name].low)
                    raise ValueError(f"register {name} has {found} addresses, needs {count}")
        unknown = self.registers.keys() - set(PER_JOINT_REGISTERS) - set(SINGLE_REGISTERS)
        if unknown:
            raise ValueError(f"register {min(unknown)} is not one that the protocol knows")
        owner: dict[int, str] = {}
        for name, register in self.registers.items():
            for address in register.addresses:
                if not self.base <= address < self.base + self.size:
                    last = self.base + self.size - 1
                    raise ValueError(f"{name} at {address:04X} lies outside {self.base:04X}–{last:04X}")
                if address in owner:
                    raise ValueError(f"{name} and {owner[address]} overlap at {address:04X}")
                owner[address] = name
        return self

    def __getitem__(self, name: str) -> Register:
        return self.registers[name]

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names like `error 2` of every register whose address is an assumption."""
        return tuple(
            f"{name} {i + 1}" if len(register.low) > 1 else name
            for name, register in self.registers.items()
            for i, provenance in enumerate(register.provenance)
            if provenance == "assumed"
        )


def parse_memory_map(text: str, origin: str = "memory map") -> MemoryMap:
    """A memory map from TOML text; `origin` names the file in errors.

    Raises MemoryMapError with one line that says what is wrong and where.
    """
    try:
        return MemoryMap.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise MemoryMapError(f"{origin}: not TOML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "registers"
        raise MemoryMapError(f"{origin}: {where}: {first['msg'].removeprefix('Value error, ')}") from error


@cache
def default_memory_map() -> MemoryMap:
    """The map that ships: documented positions of joints 1–3, everything else assumed."""
    return parse_memory_map(
        resources.files("firmware_protocol").joinpath("memory_map.toml").read_text("utf-8"), "memory_map.toml"
    )
