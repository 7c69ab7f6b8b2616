"""The bench: servos on one bus and the head that they move, advanced by its caller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from firmware_protocol.dynamixel.control_table import COUNTS_A_TURN, HardwareError, Table
from firmware_protocol.dynamixel.instructions import Instruction, StatusError, areas_read, areas_written, status
from firmware_protocol.dynamixel.packets import BROADCAST, STATUS, Packet, PacketDecoder, encode
from firmware_protocol.errors import ProtocolError
from mock_controller.servos.plant import NONE, STEP_US, Head, Motor, PanTilt, Secret
from mock_controller.servos.servo import Servo

PERIOD_US = 1000
_START = (math.pi, 2.4)
"""First posture of the head, rad of the servos: ahead, and the bar hanging at an angle."""
LEVEL = math.pi
"""Angle (rad) of the second servo at which the bar is horizontal."""


@dataclass(frozen=True)
class Options:
    """Options of a bench."""

    ids: tuple[int, ...] = (1, 2)
    supply: float = 12.0
    load: float = 0.0
    coulomb: float = 0.10
    torque: bool = False
    secret: Secret = NONE


class Bench:
    """Two servos, and the bus to them: instructions in, status packets out."""

    def __init__(self, options: Options) -> None:
        self.time_us = 0
        self.servos = [Servo(device, options.supply) for device in options.ids]
        self.gone: set[int] = set()
        """IDs of servos that are off the bus."""
        self._motor = Motor(coulomb=options.coulomb)
        self._plant = PanTilt(Head(load=options.load), self._motor, (_START[0], _START[1] - LEVEL), options.secret)
        self._decoder = PacketDecoder()
        self._waiting: dict[int, Packet] = {}
        for servo, angle in zip(self.servos, _START, strict=True):
            servo.power_up(round(COUNTS_A_TURN * angle / math.tau))
            if options.torque:
                servo.write(Table.TORQUE_ENABLE.address, b"\1")

    def advance_to(self, time_us: int) -> None:
        """Advances the bench's time."""
        while self.time_us < time_us:
            if self.time_us % PERIOD_US == 0:
                self._control()
            self._plant.step()
            self.time_us += STEP_US

    def receive(self, data: bytes) -> bytes:
        """Returns the servos' answers to bytes on the bus, one after the other."""
        answers = [answer for packet in self._decoder.feed(data) for answer in self._obey(packet)]
        return b"".join(map(encode, answers))

    def fail(self, device: int, error: HardwareError) -> None:
        """Sets a hardware error of one servo."""
        self._servo(device).fail(error)

    def reboot(self, device: int) -> None:
        """Interrupts the supply of one servo for a moment."""
        servo = self._servo(device)
        servo.power_up(servo[Table.PRESENT_POSITION])

    def angles(self) -> tuple[float, ...]:
        """True angles of the servos, rad."""
        return self._plant.position[0], self._plant.position[1] + LEVEL

    def _servo(self, device: int) -> Servo:
        return next(servo for servo in self.servos if servo.device == device)

    def _control(self) -> None:
        for joint, (servo, angle) in enumerate(zip(self.servos, self.angles(), strict=True)):
            servo.control(angle)
            self._plant.volts[joint] = servo.volts
            speed = self._plant.speed[joint]
            voltage = 0.0 if servo.volts is None else servo.volts - self._motor.back_emf * self._motor.gear * speed
            servo.show(speed, voltage / self._motor.resistance)

    def _obey(self, packet: Packet) -> Sequence[Packet]:
        if packet.instruction == STATUS:
            return ()
        present = [servo for servo in self.servos if servo.device not in self.gone]
        for servo in present:
            servo.heard()
        meant = [servo for servo in present if packet.device in (BROADCAST, servo.device)]
        try:
            return self._answers(packet, present, meant)
        except ProtocolError:
            return [_answer(servo, StatusError.DATA_LENGTH) for servo in meant if packet.device != BROADCAST]

    def _answers(self, packet: Packet, present: list[Servo], meant: list[Servo]) -> Sequence[Packet]:
        alone = packet.device != BROADCAST
        by_id = {servo.device: servo for servo in present}
        match packet.instruction:
            case Instruction.PING:
                return [_data(servo, *(servo.read(item.address, item.size) for item in _ABOUT)) for servo in meant]
            case Instruction.READ | Instruction.SYNC_READ | Instruction.BULK_READ:
                areas = [(by_id[device], at, n) for device, at, n in areas_read(packet) if device in by_id]
                return [_data(servo, servo.read(at, n)) for servo, at, n in areas]
            case Instruction.WRITE if alone:
                _, address, data = areas_written(packet)[0]
                return [_answer(servo, servo.write(address, data)) for servo in meant]
            case Instruction.WRITE | Instruction.SYNC_WRITE | Instruction.BULK_WRITE:
                self._write(packet, by_id)
                return ()
        answers = [_answer(servo, self._other(packet, servo)) for servo in meant]
        return answers if alone else ()

    def _write(self, packet: Packet, by_id: dict[int, Servo]) -> None:
        """Carries out writes without an answer."""
        for device, address, data in areas_written(packet):
            for servo in by_id.values() if device == BROADCAST else [by_id[device]] if device in by_id else []:
                servo.write(address, data)

    def _other(self, packet: Packet, servo: Servo) -> StatusError | None:
        """Carries out instructions without data of their own."""
        match packet.instruction:
            case Instruction.REG_WRITE:
                self._waiting[servo.device] = packet
            case Instruction.ACTION if servo.device in self._waiting:
                _, address, data = areas_written(self._waiting.pop(servo.device))[0]
                return servo.write(address, data)
            case Instruction.REBOOT:
                servo.power_up(servo[Table.PRESENT_POSITION])
            case _:
                return StatusError.INSTRUCTION
        return None


_ABOUT = (Table.MODEL_NUMBER, Table.FIRMWARE_VERSION)


def _data(servo: Servo, *pieces: bytes | StatusError) -> Packet:
    error = next((piece for piece in pieces if isinstance(piece, StatusError)), None)
    if error is not None:
        return _answer(servo, error)
    return status(servo.device, b"".join(piece for piece in pieces if isinstance(piece, bytes)), alert=servo.alert)


def _answer(servo: Servo, error: StatusError | None) -> Packet:
    return status(servo.device, error=error or 0, alert=servo.alert)
