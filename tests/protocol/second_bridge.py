"""A whole bridge, written from PROTOCOL.md and from nothing else, on a board that is only a memory.

It shares no code with `firmware_protocol` or the mock, and is written as a small machine would: integers, a byte
array, no objects for messages. What both say is what a bridge in another language will say.
"""

from tests.protocol.second_implementation import frame_of, read_frame

BASE, SIZE = 0xFC00, 0x80
SET_POINT, POSITION, ERROR, POWER, GAINS = 0x00, 0x20, 0x30, 0x40, (0x50, 0x58, 0x60)
INPUTS, OUTPUTS, GRIPPER = 0x70, 0x71, 0x72
HIGH = 8
"""From a value's low byte to its high byte."""
PERIOD_US = 20_000
RING = 8
COMMAND_BYTES = {0x04: (3, 5, 7, 9, 11, 13), 0x07: (4,), 0x21: (4,), 0x31: (2,), 0x32: (1,), 0x03: range(3, 41)}
"""Payload after the stamp."""
READ_BYTES = {
    0x01: range(49),
    0x02: (3,),
    0x06: (0,),
    0x08: (1,),
    0x10: (5,),
    0x20: (0,),
    0x30: (0,),
    0x33: (0,),
    0x40: (4,),
}
UNKNOWN, LENGTH, ADDRESS, VALUE, INCAPABLE, FROZEN, _, STALE, SESSION, OTHER_STOP = range(1, 11)


def number(data: bytes) -> int:
    """Little-endian."""
    return int.from_bytes(data, "little")


def mask_is_wrong(mask: int) -> bool:
    return not 0 < mask < 0x40


class SecondBridge:
    """Bytes in, bytes out. Every joint stands at 2048 counts, which is posture 500."""

    def __init__(self, first_number: int = 0x00010000) -> None:
        self.memory = bytearray(SIZE)
        self.fresh = first_number
        self.session = self.nonce = self.newest = self.stop = self.missed = 0
        self.frozen = False
        self.boots, self.restarted = 0, True
        self.waiting: tuple[int, int, int, bool] | None = None
        """Sequence number, after, mask, and whether it is from before the last reset."""
        self.input = b""
        self._power_up()

    # ---- the board

    def _power_up(self) -> None:
        self.boots += 1
        self.tick = 0
        self.ring: list[tuple[int, bytes]] = []
        self.memory[:] = bytes(SIZE)
        for joint in range(6):
            self._store(SET_POINT + joint, 500)
            self._store(POSITION + joint, 2048)
            self.memory[GAINS[0] + joint] = 2

    def _store(self, place: int, value: int) -> None:
        self.memory[place], self.memory[place + HIGH] = value & 0xFF, value >> 8 & 0xFF

    def _word(self, place: int) -> int:
        return self.memory[place] + 256 * self.memory[place + HIGH]

    def period(self) -> bytes:
        """The controller does its work once; what the bridge says then."""
        self.tick += 1
        for joint in range(6):
            counts = (2 * self._word(SET_POINT + joint) * 4096 + 1000) // 2000
            self._store(ERROR + joint, counts - self._word(POSITION + joint) & 0xFFFF)
        self.ring = [*self.ring, (self.tick, b"".join(self._reading(joint) for joint in range(6)))][-RING:]
        return self._answer_sample()

    def reset(self) -> bytes:
        """The board loses its supply and begins anew: no session outlives that, a freeze does."""
        self.session, self.restarted = 0, True
        if self.waiting is not None:
            self.waiting = (self.waiting[0], 0, self.waiting[2], True)
        self._power_up()
        return b""

    def start_again(self) -> bytes:
        """The bridge itself begins anew, on a board that went on. Its count of starts is kept, and so is the freeze."""
        self.fresh = (self.fresh // 65536 + 1) * 65536
        self.session = self.stop = 0
        self.waiting, self.restarted = None, True
        if self.frozen:
            self._number_the_stop()
        return b""

    def _number_the_stop(self) -> None:
        self.fresh += 1
        self.stop = self.fresh

    def _reading(self, joint: int) -> bytes:
        places = (SET_POINT + joint, POSITION + joint, ERROR + joint)
        words = b"".join(bytes((self.memory[place], self.memory[place + HIGH])) for place in places)
        return words + bytes((self.memory[POWER + joint],))

    # ---- the line

    def receive(self, data: bytes) -> bytes:
        """What the bridge says at once to some bytes."""
        said = b""
        self.input += data
        while (end := self.input.find(0)) >= 0:
            piece, self.input = self.input[:end], self.input[end + 1 :]
            if piece and (frame := read_frame(piece)) is not None:
                said += self._answer(*frame)
        return said

    def _answer(self, sequence: int, opcode: int, payload: bytes) -> bytes:
        reason = self._wrong(opcode, payload)
        if reason == 0 and opcode in COMMAND_BYTES:
            reason = self._not_now(opcode, payload)
            payload = payload[8:]
        if reason:
            return frame_of(sequence, 0xFF, bytes((opcode, reason)))
        if opcode == 0x10:
            self.waiting = (sequence, number(payload[:4]), payload[4], False)
            return self._answer_sample()
        return frame_of(sequence, opcode | 0x80, self._carry_out(opcode, payload))

    # ---- what is refused, in this order

    def _wrong(self, opcode: int, payload: bytes) -> int:
        """Whatever the moment: opcode, ability, length, values, addresses."""
        if opcode not in (*COMMAND_BYTES, *READ_BYTES):
            return UNKNOWN
        if opcode == 0x40:
            return INCAPABLE
        if opcode == 0x01:
            return LENGTH if payload[:1] == b"\x02" and len(payload) != 5 else 0
        if opcode in COMMAND_BYTES and len(payload) < 8:
            return LENGTH
        payload = payload[8:] if opcode in COMMAND_BYTES else payload
        return self._wrong_set_points(payload) if opcode == 0x04 else self._wrong_value(opcode, payload)

    def _wrong_value(self, opcode: int, payload: bytes) -> int:
        if len(payload) not in (COMMAND_BYTES.get(opcode) or READ_BYTES[opcode]):
            return LENGTH
        wrong = {
            0x02: lambda: not 1 <= payload[2] <= 48,
            0x07: lambda: not 1 <= payload[0] <= 6 or max(payload[1:]) > 20,
            0x08: lambda: mask_is_wrong(payload[0]),
            0x10: lambda: mask_is_wrong(payload[4]),
            0x32: lambda: payload[0] > 1,
        }
        if opcode in wrong and wrong[opcode]():
            return VALUE
        if opcode in (0x02, 0x03):
            address, count = number(payload[:2]), payload[2] if opcode == 0x02 else len(payload) - 2
            if address < BASE or address + count > BASE + SIZE:
                return ADDRESS
        return 0

    def _wrong_set_points(self, payload: bytes) -> int:
        if not payload:
            return LENGTH
        if mask_is_wrong(payload[0]):
            return VALUE
        if len(payload) != 1 + 2 * payload[0].bit_count():
            return LENGTH
        return VALUE if any(number(payload[i : i + 2]) > 999 for i in range(1, len(payload), 2)) else 0

    def _not_now(self, opcode: int, payload: bytes) -> int:
        """Session, number, state."""
        session, command = number(payload[:4]), number(payload[4:8])
        if self.session == 0 or session != self.session:
            return SESSION
        if command < self.newest:
            return STALE
        self.newest = command
        if opcode == 0x21:
            return OTHER_STOP if number(payload[8:]) != self.stop else 0
        writes_set_points = opcode == 0x04 or (opcode == 0x03 and self._reaches_set_points(payload[8:]))
        return FROZEN if self.frozen and writes_set_points else 0

    def _reaches_set_points(self, payload: bytes) -> bool:
        first = number(payload[:2]) - BASE
        places = range(first, first + len(payload) - 2)
        return any(place in places for joint in range(6) for place in (SET_POINT + joint, SET_POINT + joint + HIGH))

    # ---- what is done

    def _carry_out(self, opcode: int, payload: bytes) -> bytes:
        reads = {
            0x01: self._hello,
            0x02: lambda block: bytes(self.memory[self._place(block) : self._place(block) + block[2]]),
            0x06: lambda _: bytes(self.memory[column + joint] for joint in range(6) for column in GAINS),
            0x08: lambda mask: mask + b"".join(self._reading(joint) for joint in range(6) if mask[0] >> joint & 1),
            0x20: lambda _: self._freeze(),
            0x30: lambda _: bytes((self.memory[INPUTS], self.memory[OUTPUTS], self.memory[GRIPPER])),
            0x33: lambda _: self._all_about_the_board(),
        }
        if opcode in reads:
            return reads[opcode](payload)
        self._change(opcode, payload)
        return self._tick_and_status() if opcode == 0x04 else b""

    def _change(self, opcode: int, payload: bytes) -> None:
        match opcode:
            case 0x03:
                self.memory[self._place(payload) : self._place(payload) + len(payload) - 2] = payload[2:]
            case 0x04:
                joints = [joint for joint in range(6) if payload[0] >> joint & 1]
                for place, joint in enumerate(joints):
                    self._store(SET_POINT + joint, number(payload[1 + 2 * place : 3 + 2 * place]))
            case 0x07:
                for column, value in zip(GAINS, payload[1:], strict=True):
                    self.memory[column + payload[0] - 1] = value
            case 0x21:
                self.frozen = False
            case 0x31:
                kept = self.memory[OUTPUTS] & ~payload[0]
                self.memory[OUTPUTS] = kept | payload[1] & payload[0]
            case 0x32:
                self.memory[GRIPPER] = payload[0]

    @staticmethod
    def _place(block: bytes) -> int:
        return number(block[:2]) - BASE

    def _all_about_the_board(self) -> bytes:
        counts = self.boots.to_bytes(2, "little") + self.missed.to_bytes(4, "little")
        return self._tick_and_status() + counts + self.stop.to_bytes(4, "little")

    def _tick_and_status(self) -> bytes:
        return self.tick.to_bytes(4, "little") + bytes((self._status(),))

    def _status(self) -> int:
        return self.frozen + 2 * self.restarted

    def _hello(self, payload: bytes) -> bytes:
        capabilities = bytes((2, 1, 0))
        about = capabilities + PERIOD_US.to_bytes(4, "little") + bytes((RING,)) + self.boots.to_bytes(2, "little")
        if payload[:1] != b"\x02":
            return about
        nonce = number(payload[1:])
        if self.session == 0 or nonce != self.nonce:
            self.fresh += 1
            self.session, self.nonce, self.newest, self.restarted = self.fresh, nonce, 1, False
        return about + payload[1:] + self.session.to_bytes(4, "little")

    def _freeze(self) -> bytes:
        self._number_the_stop()
        if not self.frozen:
            self.frozen, self.frozen_tick = True, self.tick
            for joint in range(6):
                counts = self._word(POSITION + joint)
                self._store(SET_POINT + joint, min((2 * counts * 1000 + 4096) // 8192, 999))
        postures = b"".join(self._word(SET_POINT + joint).to_bytes(2, "little") for joint in range(6))
        return self.frozen_tick.to_bytes(4, "little") + postures

    def _answer_sample(self) -> bytes:
        if self.waiting is None:
            return b""
        sequence, after, mask, _ = self.waiting
        newest = self.ring[-1][0] if self.ring else 0
        if after > newest:
            after = newest
            self.waiting = (sequence, after, mask, False)
        for tick, readings in self.ring:
            if tick > after:
                self.waiting = None
                chosen = b"".join(readings[7 * joint : 7 * joint + 7] for joint in range(6) if mask >> joint & 1)
                return frame_of(sequence, 0x90, tick.to_bytes(4, "little") + bytes((self._status(), mask)) + chosen)
        return b""


class CompactSecondBridge(SecondBridge):
    """The same with COMPACT: set points and the question for a sample in one frame, and four bytes a joint back."""

    def __init__(self, first_number: int = 0x00010000) -> None:
        super().__init__(first_number)
        self.taken: int | None = None
        """For a compact question that waits: the tick after which its set points are taken."""

    def _answer(self, sequence: int, opcode: int, payload: bytes) -> bytes:
        if opcode == 0x10:
            self.taken = None
        if opcode != 0x11:
            return super()._answer(sequence, opcode, payload)
        reason = self._wrong_turn(payload) or self._not_now(opcode, payload)
        if reason == 0 and payload[13] and self.frozen:
            reason = FROZEN
        if reason:
            return frame_of(sequence, 0xFF, bytes((opcode, reason)))
        if payload[13]:
            self._change(0x04, payload[13:])
        self.taken = self.tick
        self.waiting = (sequence, number(payload[8:12]), payload[12], False)
        return self._answer_sample()

    def _wrong_turn(self, payload: bytes) -> int:
        if len(payload) < 14:
            return LENGTH
        if mask_is_wrong(payload[12]):
            return VALUE
        if payload[13] == 0:
            return LENGTH if len(payload) > 14 else 0
        return self._wrong_set_points(payload[13:])

    def _hello(self, payload: bytes) -> bytes:
        said = super()._hello(payload)
        return said[:1] + bytes((said[1] | 8,)) + said[2:]

    def _answer_sample(self) -> bytes:
        said = super()._answer_sample()
        frame = read_frame(said.strip(b"\0")) if said and self.taken is not None else None
        if frame is None:
            return said
        sequence, _, payload = frame
        compact = payload[:5] + bytes((self.taken % 256,)) + payload[5:6]
        for at in range(6, len(payload), 7):
            _, position, error, power = (
                number(payload[at + i : at + i + w]) for i, w in ((0, 2), (2, 2), (4, 2), (6, 1))
            )
            error = min(max(error - 65536 * (error >> 15), -2048), 2047)
            compact += (position + ((error & 0xFFF) << 12) + (power << 24)).to_bytes(4, "little")
        self.taken = None
        return frame_of(sequence, 0x91, compact)
