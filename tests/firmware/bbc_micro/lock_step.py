"""The emulated BBC Micro in lock-step: its time passes only in the host's turns, since py65 is slower than the machine.

The bridge knows nothing of lock-step. What stands here does what PROTOCOL.md, section 7, asks for around it: it lets
the machine run through each turn, answers Advance itself, ends every turn with the idle mark, and adds LOCK_STEP and
SIMULATED to the capabilities in HelloReply. Every other reply is the bridge's own, byte by byte.

    python -m tests.firmware.bbc_micro.lock_step 4000              serves tcp://127.0.0.1:4000?lock_step=1&baud=19200
"""

import argparse
import socket
from dataclasses import replace

from firmware_protocol import commands as c
from firmware_protocol.dialect import IDLE_MARK
from firmware_protocol.errors import ProtocolError
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from firmware_protocol.session import parse_reply, parse_request, to_frame
from mock_controller.bridge.pieces import PieceSplitter
from tests.firmware.bbc_micro.built import machine
from tests.firmware.bbc_micro.machine import BbcMicro

STEP_CYCLES = 400
LONGEST_TURN = 2 * 600_000
"""Cycles in which a request is answered: a Sample may wait for 25 periods."""
DAMAGED_TURN = 2 * 20_000
"""Cycles that a turn without a request takes."""


class LockStepBbc:
    """Bytes of the host in, bytes for the host out."""

    def __init__(self, bbc: BbcMicro) -> None:
        self.bbc = bbc
        self._splitter = PieceSplitter()
        self._said = FrameDecoder()
        self._last_advance: int | None = None
        bbc.run_until(2 * 100_000)

    def hang_up(self) -> None:
        """A serial line has no end that the bridge could see."""
        self._splitter.reset()
        self._last_advance = None

    def receive(self, data: bytes) -> bytes:
        """The turns of all whole pieces."""
        return b"".join(self._turn(piece) + IDLE_MARK for piece in self._splitter.feed(data) if piece.endswith(b"\0"))

    def _turn(self, piece: bytes) -> bytes:
        frames = FrameDecoder().feed(piece)
        if frames and frames[0].opcode == c.Advance.OPCODE:
            return encode_frame(self._advance(frames[0]))
        bbc = self.bbc
        arrived = bbc.serial.host_sends(piece)
        ends = arrived + (LONGEST_TURN if frames else DAMAGED_TURN)
        output = b""
        while bbc.cycle < ends:
            bbc.run_until(bbc.cycle + STEP_CYCLES)
            for frame in self._said.feed(bytes(byte for _, byte in bbc.serial.sent)):
                output += encode_frame(self._told(frame))
                ends = bbc.cycle if frames and frame.sequence == frames[0].sequence else ends
            bbc.serial.sent.clear()
        return output

    def _advance(self, frame: Frame) -> Frame:
        try:
            request = parse_request(frame)
        except ProtocolError:
            return to_frame(frame.sequence, c.Refused(frame.opcode, c.Refusal.BAD_LENGTH))
        assert isinstance(request, c.Advance)
        if frame.sequence != self._last_advance and request.microseconds:
            self.bbc.run_until(self.bbc.cycle + 2 * request.microseconds)
            self._last_advance = frame.sequence
        return to_frame(frame.sequence, c.Advanced(self.bbc.time_us, self.bbc.variable("tick", 4)))

    @staticmethod
    def _told(frame: Frame) -> Frame:
        if frame.opcode != c.HelloReply.OPCODE:
            return frame
        reply = parse_reply(frame)
        assert isinstance(reply, c.HelloReply)
        added = c.Capability.LOCK_STEP | c.Capability.SIMULATED
        return to_frame(frame.sequence, replace(reply, capabilities=reply.capabilities | added))


def serve(port: int, name: str, seed: int) -> None:
    """One connection after the other, until it is interrupted."""
    bbc = LockStepBbc(machine(name, seed))
    with socket.create_server(("127.0.0.1", port)) as listener:
        at = listener.getsockname()[1]
        print(f"tcp://127.0.0.1:{at}?lock_step=1&baud={bbc.bbc.serial.baud}", flush=True)
        while True:
            connection, _ = listener.accept()
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                while data := connection.recv(4096):
                    connection.sendall(bbc.receive(data))
            bbc.hang_up()


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description="An emulated BBC Micro with the bridge, in lock-step at a TCP port.")
    parser.add_argument("port", type=int, nargs="?", default=0)
    parser.add_argument("--image", choices=("BRIDGE", "BRIDG96"), default="BRIDGE", help="19200 or 9600 baud")
    parser.add_argument("--seed", type=int, default=1, help="of the mock's board")
    given = parser.parse_args()
    serve(given.port, given.image, given.seed)


if __name__ == "__main__":
    main()
