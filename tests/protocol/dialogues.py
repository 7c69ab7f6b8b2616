"""What hosts and bridges say to each other, step by step, with names for what every bridge chooses itself.

A step is what the host sends, what the bridge answers, or what happens to the board:

    host("Release", 7, session="$s", number=2, stop="$k")     sequence number, then the fields
    raw(0x04, "0001", 7)                                      a payload that no host would send
    bridge("Released", 7)
    board("period"), board("reset"), board("bridge")          a period ends; the board, or the bridge, begins anew

`"$s"` stands for a value: the first reply that holds it says what it is, and the host chooses what it names first.
`"$s+1"` is one more. `"?"` is anything. Set points that are written are those in force, so that nothing moves.
"""

from dataclasses import dataclass
from typing import Any

Step = dict[str, Any]
AFTER_NEWEST = 0xFFFFFFFF
ABOUT = {"version": 2, "capabilities": "?", "period_us": "?", "ring_depth": "?", "boots": "?"}


@dataclass(frozen=True)
class Dialogue:
    """`needs`: SAMPLE, a bridge with snapshots; COMPACT, one that takes the turn for slow lines; CLOCK, one whose time
    is not the host's (no lock-step); RESET, RESTART: somebody who can reset the board, start the bridge again."""

    rule: str
    needs: tuple[str, ...]
    steps: tuple[Step, ...]


def host(message: str, sequence: int, /, **fields: Any) -> Step:
    return {"host": message, "sequence": sequence, "fields": fields}


def raw(opcode: int, payload: str, sequence: int) -> Step:
    return {"host": opcode, "sequence": sequence, "payload": payload}


def bridge(message: str, sequence: int, /, **fields: Any) -> Step:
    return {"bridge": message, "sequence": sequence, "fields": fields}


def board(event: str) -> Step:
    return {"board": event}


def refused(opcode: int, reason: int, sequence: int) -> Step:
    return bridge("Refused", sequence, opcode=opcode, reason=reason)


def greeting(nonce: str, session: str, sequence: int) -> tuple[Step, Step]:
    return (
        host("Hello", sequence, version=2, nonce=nonce),
        bridge("HelloReply", sequence, **ABOUT, nonce=nonce, session=session),
    )


def set_point_in_force(sequence: int) -> tuple[Step, Step]:
    reading = {"set_point": "$p", "position": "?", "error": "?", "power": "?"}
    return (
        host("ReportErrorsPositionsPowers", sequence, mask=1),
        bridge("ErrorsPositionsPowers", sequence, joints=[[1, reading]]),
    )


def write(sequence: int, session: Any, number: int) -> Step:
    return host("WriteSetPoints", sequence, session=session, number=number, postures=[[1, "$p"]])


def release(sequence: int, session: Any, number: int, stop: str) -> Step:
    return host("Release", sequence, session=session, number=number, stop=stop)


def status(sequence: int, flags: int | str, stop: str) -> tuple[Step, Step]:
    told = {"tick": "?", "status": flags, "boots": "?", "missed": "?", "stop": stop}
    return host("ReadStatus", sequence), bridge("Status", sequence, **told)


def snapshot(sequence: int, tick: int | str, flags: int | str = 0) -> Step:
    reading = {"set_point": "?", "position": "?", "error": "?", "power": "?"}
    return bridge("Snapshot", sequence, tick=tick, status=flags, joints=[[1, reading]])


def freed(first: int, session: str, number: int) -> tuple[Step, ...]:
    """Whatever stop came before the dialogue is released, and a set point in force is known."""
    second, third = (first + 1) & 0xFFFF, (first + 2) & 0xFFFF
    return (*status(first, "?", "$before"), *released(second, session, number, "$before"), *set_point_in_force(third))


def wrote(sequence: int, session: Any, number: int) -> tuple[Step, Step]:
    return write(sequence, session, number), bridge("SetPointsTaken", sequence, tick="?", status=0)


def kept_from_writing(sequence: int, session: Any, number: int, reason: int) -> tuple[Step, Step]:
    return write(sequence, session, number), refused(0x04, reason, sequence)


def released(sequence: int, session: Any, number: int, stop: str) -> tuple[Step, Step]:
    return release(sequence, session, number, stop), bridge("Released", sequence)


def kept_from_releasing(sequence: int, session: Any, number: int, stop: str, reason: int) -> tuple[Step, Step]:
    return release(sequence, session, number, stop), refused(0x21, reason, sequence)


def stopped(sequence: int, tick: str = "?", posture: str = "?") -> tuple[Step, Step]:
    return host("Stop", sequence), bridge("Stopped", sequence, tick=tick, postures=[posture, *["?"] * 5])


def misunderstood(opcode: int, payload: str, sequence: int, reason: int) -> tuple[Step, Step]:
    return raw(opcode, payload, sequence), refused(opcode, reason, sequence)


def sample(sequence: int, after: int | str) -> Step:
    return host("Sample", sequence, after=after, mask=1)


def had_at_once(sequence: int, after: int | str, tick: int | str) -> tuple[Step, Step]:
    return sample(sequence, after), snapshot(sequence, tick)


def waited_for(sequence: int, after: int | str, tick: int | str, flags: int | str = 0) -> tuple[Step, Step, Step]:
    return sample(sequence, after), board("period"), snapshot(sequence, tick, flags)


def turn(sequence: int, session: str, number: int, after: int | str, postures: list[Any]) -> Step:
    fields = {"session": session, "number": number, "after": after, "sampled": 1, "postures": postures}
    return host("MoveAndSample", sequence, **fields)


def compact(sequence: int, tick: int | str) -> Step:
    joints = [[1, {"position": "?", "error": "?", "power": "?"}]]
    return bridge("CompactSnapshot", sequence, tick=tick, status="?", taken="?", joints=joints)


BAD_LENGTH, BAD_ADDRESS, BAD_VALUE, NOT_CAPABLE, FROZEN, STALE, BAD_SESSION, OTHER_STOP = 2, 3, 4, 5, 6, 8, 9, 10

DIALOGUES = (
    Dialogue(
        "no command is obeyed without a session",
        (),
        (
            *set_point_in_force(1),
            *kept_from_writing(2, 0, 1, BAD_SESSION),
            *kept_from_releasing(3, 0, 1, "$any", BAD_SESSION),
            *greeting("$n", "$s", 4),
            *freed(5, "$s", 1),
            *wrote(8, "$s", 2),
            *kept_from_writing(9, "$s+1", 3, BAD_SESSION),
        ),
    ),
    Dialogue(
        "a repeat is answered again, an earlier command is stale",
        (),
        (
            *greeting("$n", "$s", 0xFFFD),
            *freed(0xFFFE, "$s", 1),
            *wrote(10, "$s", 10),
            *wrote(10, "$s", 10),
            *wrote(10, "$s", 10),
            *kept_from_writing(9, "$s", 9, STALE),
            *status(9, 0, "$before"),
            *wrote(12, "$s", 12),
            *kept_from_writing(11, "$s", 11, STALE),
        ),
    ),
    Dialogue(
        "numbers of commands do not wrap, however sequence numbers do",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *wrote(100, "$s", 100),
            *wrote(100, "$s", 65636),
            *kept_from_writing(100, "$s", 100, STALE),
            *wrote(5, "$s", 0xFFFFFFFF),
            *kept_from_writing(6, "$s", 0, STALE),
            *kept_from_writing(7, "$s", 0x7FFFFFFF, STALE),
            *wrote(8, "$s", 0xFFFFFFFF),
        ),
    ),
    Dialogue(
        "a repeated greeting changes nothing, another begins a new session",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *wrote(5, "$s", 50),
            *greeting("$n", "$s", 1),
            *kept_from_writing(6, "$s", 49, STALE),
            *wrote(7, "$s", 51),
            *greeting("$m", "$t", 8),
            *kept_from_writing(9, "$s", 52, BAD_SESSION),
            *wrote(10, "$t", 1),
        ),
    ),
    Dialogue(
        "a host of version 1 is told the version, and disturbs nobody",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            raw(0x01, "", 0),
            bridge("HelloReply", 0, **ABOUT, nonce=0, session=0),
            *wrote(5, "$s", 2),
            *misunderstood(0x04, "01f401", 1, 2),
        ),
    ),
    Dialogue(
        "a stop holds until it is released by its number",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *stopped(0, "$f", "$q"),
            *status(6, 1, "$k"),
            *kept_from_writing(7, "$s", 2, FROZEN),
            host("WriteBlock", 8, session="$s", number=3, address=0xFC00, data="00"),
            refused(0x03, FROZEN, 8),
            *kept_from_releasing(9, "$s", 4, "$k-1", OTHER_STOP),
            *status(10, 1, "$k"),
            *released(11, "$s", 5, "$k"),
            *released(11, "$s", 5, "$k"),
            *status(12, 0, "$k"),
            host("WriteSetPoints", 13, session="$s", number=6, postures=[[1, "$q"]]),
            bridge("SetPointsTaken", 13, tick="?", status=0),
        ),
    ),
    Dialogue(
        "a second stop changes nothing but the number that releases it",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *stopped(5, "$f", "$q"),
            *status(6, 1, "$k"),
            *stopped(5, "$f", "$q"),
            *status(7, 1, "$l"),
            *kept_from_releasing(8, "$s", 2, "$k", OTHER_STOP),
            *status(9, 1, "$l"),
            *released(10, "$s", 3, "$l"),
            *status(11, 0, "$l"),
        ),
    ),
    Dialogue(
        "a recorded release does not end a later stop",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *stopped(5),
            *status(6, 1, "$k"),
            *released(7, "$s", 2, "$k"),
            *stopped(8),
            *status(9, 1, "$l"),
            *kept_from_releasing(7, "$s", 2, "$k", OTHER_STOP),
            *kept_from_releasing(10, "$s", 3, "$k", OTHER_STOP),
            *status(11, 1, "$l"),
            *released(12, "$s", 4, "$l"),
        ),
    ),
    Dialogue(
        "a recorded session does nothing when it is played back",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *wrote(5, "$s", 2),
            *stopped(6),
            *status(7, 1, "$k"),
            *released(8, "$s", 3, "$k"),
            *greeting("$m", "$t", 9),
            *stopped(10),
            *status(11, 1, "$l"),
            *kept_from_writing(5, "$s", 2, BAD_SESSION),
            *kept_from_releasing(8, "$s", 3, "$k", BAD_SESSION),
            *greeting("$n", "$u", 1),
            *kept_from_writing(5, "$s", 2, BAD_SESSION),
            *kept_from_releasing(8, "$s", 3, "$k", BAD_SESSION),
            *kept_from_releasing(12, "$t", 1, "$l", BAD_SESSION),
            *status(13, 1, "$l"),
            *greeting("$o", "$v", 14),
            *released(15, "$v", 1, "$l"),
        ),
    ),
    Dialogue(
        "what passes session and number moves the number, though it is refused then",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            host("WriteBlock", 5, session="$s", number=90, address=0, data="00"),
            refused(0x03, BAD_ADDRESS, 5),
            *kept_from_writing(6, "$s+1", 91, BAD_SESSION),
            *wrote(7, "$s", 20),
            *kept_from_releasing(8, "$s", 30, "$before+1", OTHER_STOP),
            *kept_from_writing(9, "$s", 29, STALE),
            *stopped(10),
            *status(11, 1, "$k"),
            *kept_from_writing(12, "$s", 40, FROZEN),
            *kept_from_writing(13, "$s", 39, STALE),
            *kept_from_releasing(14, "$s", 39, "$k", STALE),
            *released(15, "$s", 41, "$k"),
        ),
    ),
    Dialogue(
        "of several reasons to refuse, the first is told",
        (),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *stopped(5),
            *status(6, 1, "$k"),
            *misunderstood(0x55, "", 7, 1),
            *misunderstood(0x04, "00" * 7, 8, 2),
            *misunderstood(0x04, "00" * 8 + "01e803", 9, BAD_VALUE),
            *misunderstood(0x04, "00" * 8 + "010100ff", 10, 2),
            *misunderstood(0x02, "ffff02", 11, BAD_ADDRESS),
            *misunderstood(0x02, "000000", 12, BAD_VALUE),
            *misunderstood(0x02, "ffff31", 13, BAD_VALUE),
            *misunderstood(0x03, "00" * 8 + "fffbaa", 14, BAD_ADDRESS),
            *misunderstood(0x03, "00" * 8 + "ffffaaaa", 15, BAD_ADDRESS),
            *kept_from_writing(16, 0, 1, BAD_SESSION),
            *kept_from_writing(17, "$s", 0, STALE),
            *kept_from_writing(18, "$s", 2, FROZEN),
            *released(19, "$s", 3, "$k"),
        ),
    ),
    Dialogue(
        "what a bridge cannot do it refuses before it looks at the payload",
        ("CLOCK",),
        (*misunderstood(0x40, "", 1, NOT_CAPABLE), *misunderstood(0x40, "e8030000", 2, NOT_CAPABLE)),
    ),
    Dialogue(
        "the ring gives each period once, in order, and a lost reply costs nothing",
        ("SAMPLE",),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *waited_for(6, AFTER_NEWEST, "$t"),
            *waited_for(7, "$t", "$t+1"),
            *waited_for(8, "$t+1", "$t+2"),
            *had_at_once(9, "$t", "$t+1"),
            *had_at_once(10, "$t", "$t+1"),
            *had_at_once(11, "$t+1", "$t+2"),
        ),
    ),
    Dialogue(
        "the turn for slow lines writes set points and asks for a sample in one frame",
        ("SAMPLE", "COMPACT"),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *waited_for(6, AFTER_NEWEST, "$t"),
            turn(8, "$s", 2, "$t", [[1, "$p"]]),
            board("period"),
            compact(8, "$t+1"),
            turn(8, "$s", 2, "$t", [[1, "$p"]]),
            compact(8, "$t+1"),
            turn(9, "$s", 1, "$t", [[1, "$p"]]),
            refused(0x11, STALE, 9),
            turn(10, "$s+1", 3, "$t", [[1, "$p"]]),
            refused(0x11, BAD_SESSION, 10),
            turn(11, "$s", 3, "$t", []),
            compact(11, "$t+1"),
            *stopped(12),
            turn(13, "$s", 4, "$t", [[1, "$p"]]),
            refused(0x11, FROZEN, 13),
            turn(14, "$s", 5, "$t", []),
            compact(14, "$t+1"),
            *status(15, 1, "$k"),
            *released(16, "$s", 6, "$k"),
        ),
    ),
    Dialogue(
        "while a sample waits all else is answered, a greeting too, and leaves it waiting",
        ("SAMPLE", "CLOCK"),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *waited_for(6, AFTER_NEWEST, "$t"),
            sample(7, "$t"),
            *greeting("$m", "$u", 8),
            *stopped(9),
            *status(10, 1, "$k"),
            board("period"),
            snapshot(7, "$t+1", "?"),
            *released(11, "$u", 1, "$k"),
        ),
    ),
    Dialogue(
        "a later sample takes the place of one that waits",
        ("SAMPLE", "CLOCK"),
        (
            *waited_for(6, AFTER_NEWEST, "$t", "?"),
            sample(7, AFTER_NEWEST),
            *waited_for(8, "$t", "$t+1", "?"),
            board("period"),
        ),
    ),
    Dialogue(
        "a reset of the board ends the session, and is told until the next greeting",
        ("RESET",),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *wrote(5, "$s", 2),
            board("reset"),
            *status(6, 2, "$before"),
            *kept_from_writing(5, "$s", 2, BAD_SESSION),
            *kept_from_writing(7, "$s", 3, BAD_SESSION),
            *stopped(8),
            *status(9, 3, "$k"),
            board("reset"),
            *status(9, 3, "$k"),
            *greeting("$n", "$t", 10),
            *status(11, 1, "$k"),
            *kept_from_writing(12, "$s", 4, BAD_SESSION),
            *released(13, "$t", 1, "$k"),
            *status(14, 0, "$k"),
        ),
    ),
    Dialogue(
        "a sample that waits over a reset is answered from the new life",
        ("SAMPLE", "CLOCK", "RESET"),
        (
            *greeting("$n", "$s", 1),
            *waited_for(6, AFTER_NEWEST, "$t", "?"),
            sample(7, "$t"),
            board("reset"),
            board("period"),
            snapshot(7, 1, "?"),
            *greeting("$m", "$u", 8),
            *freed(9, "$u", 1),
        ),
    ),
    Dialogue(
        "a bridge that starts again knows no session, and its stops have new numbers",
        ("RESTART",),
        (
            *greeting("$n", "$s", 1),
            *freed(2, "$s", 1),
            *wrote(5, "$s", 2),
            *stopped(6),
            *status(7, 1, "$k"),
            *released(8, "$s", 3, "$k"),
            board("bridge"),
            *kept_from_writing(5, "$s", 2, BAD_SESSION),
            *greeting("$n", "$t", 1),
            *stopped(9),
            *status(10, 1, "$l"),
            *kept_from_writing(5, "$s", 2, BAD_SESSION),
            *kept_from_releasing(8, "$s", 3, "$k", BAD_SESSION),
            *kept_from_releasing(11, "$t", 1, "$k", OTHER_STOP),
            *released(12, "$t", 2, "$l"),
        ),
    ),
)
