"""The lowest level of the protocol once more, written from PROTOCOL.md's pseudo-code and from nothing else.

It shares no code with `firmware_protocol`: what both say is what a bridge in another language will say.
"""


def crc_bit_by_bit(data: bytes) -> int:
    """CRC-16, polynomial 1021, start FFFF, most significant bit first."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            top = crc & 0x8000
            crc = crc << 1 & 0xFFFF
            if top:
                crc ^= 0x1021
    return crc


def stuff_byte_by_byte(body: bytes) -> bytes:
    """COBS by a place that is filled in later, as a microcontroller does it."""
    out = bytearray([0])
    code_at = 0
    for byte in body:
        if byte == 0:
            out[code_at] = len(out) - code_at
            code_at = len(out)
            out.append(0)
        else:
            out.append(byte)
    out[code_at] = len(out) - code_at
    return bytes(out)


def unstuff_byte_by_byte(encoded: bytes) -> bytes | None:
    """COBS undone by counting down to the next code; None when it does not come out even."""
    out = bytearray()
    left = 0
    for i, byte in enumerate(encoded):
        if left == 0:
            if i > 0:
                out.append(0)
            left = byte
        else:
            out.append(byte)
        left -= 1
    return bytes(out) if left == 0 and encoded else None


def frame_of(sequence: int, opcode: int, payload: bytes) -> bytes:
    """A whole frame with its delimiters."""
    body = bytes([len(payload), sequence % 256, sequence // 256, opcode]) + payload
    crc = crc_bit_by_bit(body)
    return b"\0" + stuff_byte_by_byte(body + bytes([crc // 256, crc % 256])) + b"\0"


def read_frame(between_zeros: bytes) -> tuple[int, int, bytes] | None:
    """(sequence, opcode, payload) of what stands between two zeros, or None."""
    body = unstuff_byte_by_byte(between_zeros) if len(between_zeros) <= 55 else None
    if body is None or len(body) < 6 or len(body) != body[0] + 6 or crc_bit_by_bit(body) != 0:
        return None
    return body[1] + 256 * body[2], body[3], body[4:-2]
