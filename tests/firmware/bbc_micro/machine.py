"""A BBC Micro with the MA2000's memory on its 1 MHz bus, as far as the bridge uses it: py65, cycle by cycle.

The operating system is two lines: its interrupt entry, and OSWRCH. Chips and shared memory are at absolute addresses,
and the bridge reaches them with absolute instructions only; so only those are looked at, and all else runs at py65's
speed.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from py65.devices.mpu6502 import MPU

from mock_controller.board.board import Board
from tests.firmware.bbc_micro.serial import SerialPort

LOAD_ADDRESS = 0x1900
INTERRUPT_ENTRY = bytes.fromhex("85fc 6848 2910 d003 6c0402 40".replace(" ", ""))
"""STA &FC: PLA: PHA: AND #&10: BNE brk: JMP (&0204): .brk RTI"""
ENTRY_ADDRESS, OSWRCH, SCREEN = 0xDC1C, 0xFFEE, 0xFE9F
STORES = {0x8D, 0x8E, 0x8C, 0x9D, 0x99}
LOADS_AND_LOGIC = {0xAD, 0xAE, 0xAC, 0xBD, 0xB9, 0xCD, 0xDD, 0xD9, 0x4D, 0x0D, 0x2D, 0x6D, 0xED, 0xEC, 0xCC, 0x2C}
INDEXED_BY_X, INDEXED_BY_Y = {0x9D, 0xBD, 0xDD}, {0x99, 0xB9, 0xD9}
SYSTEM_TIMER_US = 9_998 + 2
USER_TIMER_US = 0xFFFF + 2


class BbcMicro:
    """Runs an image that was loaded to 1900 and started there, as by *RUN."""

    def __init__(self, image: Path, board: Board, switched_on_us: int = 123_456_789) -> None:
        """`switched_on_us`: since when the machine has been on, from which the bridge draws its first number."""
        self.serial = SerialPort()
        self.board = board
        self.screen = ""
        self.shared_accesses = 0
        self.on_the_bus: Callable[[int, int], int] = lambda _address, value: value
        """What the bridge gets of the value at an address of the shared memory."""
        self.labels = {
            name: int(address, 16)
            for address, name in re.findall(r"^al (\w+) \.(\w+)$", Path(f"{image}.labels").read_text(), re.MULTILINE)
        }
        self._on_us = switched_on_us
        self._user_timer_from = 0
        memory = [0xA5] * 0x10000  # what a memory holds at power-up is no business of the bridge
        self._put(memory, LOAD_ADDRESS, image.read_bytes())
        self._put(memory, ENTRY_ADDRESS, INTERRUPT_ENTRY)
        self._put(memory, OSWRCH, bytes((0x8D, SCREEN & 0xFF, SCREEN >> 8, 0x60)))
        self._put(memory, 0xFFFE, ENTRY_ADDRESS.to_bytes(2, "little"))
        self._put(memory, 0x0292, (switched_on_us // 10_000).to_bytes(5, "big"))
        self.memory = memory
        self.cpu: Any = MPU(memory, LOAD_ADDRESS)
        self.deepest = 0xFF

    @staticmethod
    def _put(memory: list[int], address: int, data: bytes) -> None:
        memory[address : address + len(data)] = data

    @property
    def cycle(self) -> int:
        """Processor cycles (of 0.5 µs) since the bridge was started."""
        return int(self.cpu.processorCycles)

    @property
    def time_us(self) -> int:
        """Time since the bridge was started."""
        return self.cycle // 2

    def variable(self, name: str, size: int) -> int:
        """A variable of the bridge."""
        at = self.labels[name]
        return int.from_bytes(bytes(self.memory[at : at + size]), "little")

    def run_until(self, cycle: int) -> None:
        """Runs instructions up to a cycle; the last one may end a little later."""
        cpu, memory, serial = self.cpu, self.memory, self.serial
        step = cpu.step
        while cpu.processorCycles < cycle:
            serial.run_until(cpu.processorCycles)
            if serial.interrupts:
                cpu.irq()
            until = min(cycle, serial.next_event)
            while cpu.processorCycles < until:
                pc = cpu.pc
                if memory[pc + 2] >= 0xFC and (memory[pc] in STORES or memory[pc] in LOADS_AND_LOGIC):
                    chip = self._step_at_a_chip(memory[pc], pc)
                    if chip:
                        break  # the interrupt line may have changed
                else:
                    step()
                if memory[pc] in (0x58, 0x40, 0x28):  # CLI, RTI, PLP: an interrupt may be waiting
                    break
            self.deepest = min(self.deepest, cpu.sp)
        serial.run_until(cpu.processorCycles)
        self.board.run_until(self.time_us)

    def _step_at_a_chip(self, opcode: int, pc: int) -> bool:
        """One instruction that reaches the 1 MHz bus or a chip; whether it was a chip of the machine."""
        cpu, memory = self.cpu, self.memory
        index = cpu.x if opcode in INDEXED_BY_X else cpu.y if opcode in INDEXED_BY_Y else 0
        address = (memory[pc + 1] | memory[pc + 2] << 8) + index
        cpu.processorCycles += 1 + (cpu.processorCycles & 1)  # stretched to the 1 MHz clock
        if opcode not in STORES:
            memory[address] = self._read(address)
        cpu.step()
        if opcode in STORES:
            self._write(address, memory[address])
        return address >= 0xFE00

    def _read(self, address: int) -> int:
        if address < 0xFD00:
            return self.on_the_bus(address, self._at_the_board(lambda: self.board.read(address, 1)[0]))
        match address:
            case 0xFE08 | 0xFE09:
                self.serial.run_until(self.cycle)
                return self.serial.read(address & 1)
            case 0xFE44 | 0xFE45:
                count = SYSTEM_TIMER_US - 2 - (self._on_us + self.time_us) % SYSTEM_TIMER_US & 0xFFFF
            case 0xFE64 | 0xFE65:
                count = 0xFFFF - (self.time_us - self._user_timer_from) % USER_TIMER_US & 0xFFFF
            case _:
                raise AssertionError(f"the bridge reads {address:04X}")
        return count >> 8 if address & 1 else count & 0xFF

    def _write(self, address: int, value: int) -> None:
        if address < 0xFD00:
            self._at_the_board(lambda: self.board.write(address, bytes((value,))))
            return
        match address:
            case 0xFE08 | 0xFE09:
                self.serial.run_until(self.cycle)
                self.serial.write(address & 1, value)
            case 0xFE10:
                self.serial.set_rate(value)
            case 0xFE65:
                self._user_timer_from = self.time_us
            case 0xFE64 | 0xFE6B:
                pass
            case 0xFE4E | 0xFE6E:
                assert value == 0x7F, "all interrupts of a VIA are switched off"
            case _ if address == SCREEN:
                self.screen += chr(value)
            case _:
                raise AssertionError(f"the bridge writes {address:04X}")

    def _at_the_board(self, access: Any) -> Any:
        """An access takes 1 µs of the board's time, and waits where the controller has the memory."""
        board = self.board
        board.run_until(self.time_us)
        result = access()
        self.shared_accesses += 1
        self.cpu.processorCycles = max(self.cpu.processorCycles, 2 * board.time_us)
        return result
