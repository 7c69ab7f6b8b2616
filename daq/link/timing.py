"""All time-outs and retry counts of the link."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.commands import REPLIES, Hello, MoveAndSample, Sample, Stop
from firmware_protocol.framing import FRAME_OVERHEAD, MAX_PAYLOAD
from firmware_protocol.message import Request
from firmware_protocol.scale import LineScale

REPLY_MARGIN_S = 0.025
"""Time (s) for a reply beyond its time on the line: for bridge, adapter (USB delays bytes by up to 16 ms) and host."""
STOP_MARGIN_S = 0.010
"""The same for a stop. It is repeated sooner because a repetition has no cost."""
SHARED_STOP_MARGIN_S = REPLY_MARGIN_S
"""The same for a stop on a wire that both sides share. An earlier repetition would collide with an answer. It would
also interrupt the 20 ms of silence after which servos that received the stop halt by themselves."""
RETRIES = 8
"""Repetitions of one request. If 10 % of the frames are damaged, one transaction in 10^6 fails."""
HELLO_RETRIES = 40
"""Repetitions of a `Hello`, about 2 s in all. Some adapters reset the bridge when the port opens, and a controller on a
busy machine needs as long. A `Hello` moves nothing, so it may wait."""
STOP_RETRIES = 50
STOP_COPIES = 2
"""Copies of a stop that are written at once. The second takes 0.8 ms at 115200 baud, a time-out 20 times that."""
LOCK_STEP_WATCHDOG_S = 10.0
"""Time (s) of silence after which a lock-step process counts as dead. Lock-step uses no other wall time."""
CLEAN_TRANSACTIONS = 100
"""Transactions without repetition after which a degraded link counts as connected again."""

MAX_FRAME_BYTES = MAX_PAYLOAD + FRAME_OVERHEAD


@dataclass(frozen=True)
class LinkTiming:
    """Time-outs derived from the line and from the controller's period."""

    bytes_per_second: float
    period_s: float = 0.020
    """Control period (s); `Sample` waits for at most one."""
    retries: int = RETRIES
    measured: bool = True
    """Whether round trips are measured; meaningless in lock-step."""

    def reply_timeout_s(self, request: Request, bytes_ahead: int) -> float:
        """Longest time (s) for a reply to `request` while `bytes_ahead` bytes, including its own, are being sent.

        The reply may wait for another full-length one that is already on its way.
        """
        line = (bytes_ahead + 2 * MAX_FRAME_BYTES) / self.bytes_per_second
        if isinstance(request, Stop):
            return line + STOP_MARGIN_S
        waiting = self.period_s if isinstance(request, Sample | MoveAndSample) else 0.0
        return line + REPLY_MARGIN_S + waiting

    def shared_wire_s(self, request: Request, scale: LineScale) -> float:
        """Additional time (s) if both sides share one wire: an exchange on that line, or its greeting."""
        if not scale.half_duplex:
            return 0.0
        answer = max(scale.turn_bytes or 0, scale.greeting_bytes if isinstance(request, Hello) else 0)
        stop = SHARED_STOP_MARGIN_S - STOP_MARGIN_S if isinstance(request, Stop) else 0.0
        return answer / self.bytes_per_second + stop

    def retries_of(self, request: Request) -> int:
        """How often `request` is repeated before it fails. Greeting and stop have separate numbers."""
        if isinstance(request, Stop):
            return STOP_RETRIES
        return max(HELLO_RETRIES, self.retries) if isinstance(request, Hello) else self.retries


def copies_of(request: Request) -> int:
    """How often `request` is written at once."""
    return STOP_COPIES if isinstance(request, Stop) else 1


def reply_opcode(request: Request) -> int:
    """Opcode of the reply that answers `request`."""
    opcode = request.OPCODE | 0x80
    assert opcode in REPLIES
    return opcode
