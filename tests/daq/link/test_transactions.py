"""What a link makes of lost, late, repeated, foreign and refused replies."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.link import Link, LinkLostError, LinkState, LinkTimeoutError, RequestRefusedError
from daq.link.counters import Tally
from daq.link.pending import SEQUENCE_NUMBERS, PendingReplies
from daq.link.timing import HELLO_RETRIES, RETRIES
from firmware_protocol import commands as c
from firmware_protocol.joints import JointReading
from firmware_protocol.message import Reply, Request
from tests.daq.link.scripted import ScriptedChannel, ScriptedEndpoint, Zeros, frame_of, once_silent, says, scripted_link

STATUS = c.Status(7, 0, 1, 0, 0)
TAKEN = c.SetPointsTaken(7, 0)
SNAPSHOT = c.Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),))


def right_reply(request: Request) -> Reply:
    match request:
        case c.ReadBlock():
            return c.Block(request.address.to_bytes(2, "little") * (request.count // 2))
        case c.WriteSetPoints():
            return TAKEN
        case c.Sample():
            return SNAPSHOT
        case _:
            return STATUS


def test_a_request_gets_its_reply_and_a_lost_reply_is_asked_for_under_the_same_number() -> None:
    seen: list[int] = []

    def loses_the_first(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        seen.append(sequence)
        return [(0.001, frame_of(sequence, STATUS))] if len(seen) > 1 else []

    link, _ = scripted_link(loses_the_first)
    assert link.request(c.ReadStatus(), c.Status) == STATUS
    assert seen == [0, 0]
    assert (link.counters.requests, link.counters.retries, link.counters.timeouts) == (1, 1, 1)
    assert link.state is LinkState.DEGRADED
    for _ in range(99):
        link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.DEGRADED
    link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.CONNECTED
    assert seen[2:] == list(range(1, 101))


def test_the_budget_of_a_transaction_ends_in_one_line_and_outlasts_a_bridge_that_starts_anew() -> None:
    link, channel = scripted_link(lambda _sequence, _request: [])
    with pytest.raises(LinkTimeoutError, match=rf"script: no reply to ReadStatus, asked {RETRIES + 1} times") as caught:
        link.request(c.ReadStatus(), c.Status)
    assert caught.value.sent
    assert len(channel.asked) == RETRIES + 1
    assert len({sequence for sequence, _ in channel.asked}) == 1
    assert link.state is LinkState.LOST
    link, channel = scripted_link(lambda _sequence, _request: [])
    begun = channel.now()
    with pytest.raises(LinkTimeoutError, match="no reply to Hello"):
        link.greet()
    assert len(channel.asked) == HELLO_RETRIES + 1
    assert channel.now() - begun > 1.0


def test_requests_written_together_cost_one_write_and_only_the_lost_one_is_repeated() -> None:
    lost = iter([True])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        if isinstance(request, c.WriteSetPoints) and next(lost, False):
            return []
        return [(0.002, frame_of(sequence, right_reply(request)))]

    link, channel = scripted_link(answer)
    replies = link.exchange(c.WriteSetPoints(((1, 500),)), c.Sample(7, 1))
    assert replies == (TAKEN, SNAPSHOT)
    assert len(channel.writes) == 2
    assert [type(request).__name__ for _, request in channel.asked] == ["WriteSetPoints", "Sample", "WriteSetPoints"]


def test_a_reply_that_nobody_waits_for_is_dropped_and_counted() -> None:
    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        foreign = frame_of(sequence + 500, STATUS)
        wrong_kind = frame_of(sequence, TAKEN)
        right = frame_of(sequence, STATUS)
        return [(0.001, foreign), (0.001, wrong_kind), (0.001, right + right)]

    link, _ = scripted_link(answer)
    assert link.request(c.ReadStatus(), c.Status) == STATUS
    assert (link.counters.stale, link.counters.duplicates) == (2, 1)


def test_a_refusal_says_which_request_and_why_and_is_counted_by_itself() -> None:
    link, channel = scripted_link(says(lambda request: c.Refused(request.OPCODE, c.Refusal.FROZEN)))
    with pytest.raises(RequestRefusedError, match="refused WriteSetPoints: it has been stopped"):
        link.request(c.WriteSetPoints(((1, 500),)), c.SetPointsTaken)
    assert len(channel.asked) == 1
    assert link.counters.refused == 1
    refused = c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.FROZEN)
    link, _ = scripted_link(
        says(lambda request: refused if isinstance(request, c.WriteSetPoints) else right_reply(request))
    )
    assert link.state is LinkState.CONNECTED
    replies = link.exchange(c.WriteSetPoints(((1, 500),)), c.Sample(7, 1), c.WriteSetPoints(((1, 501),)))
    assert [type(reply).__name__ for reply in replies] == ["Refused", "Snapshot", "Refused"]
    assert (link.counters.refused, link.state) == (2, LinkState.CONNECTED)


def test_round_trips_are_measured_where_it_is_known_which_copy_was_answered() -> None:
    delays = iter([0.004, 0.004, 0.500])  # the third comes after repetitions: not measured

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        return [(next(delays, 0.004), frame_of(sequence, STATUS))]

    link, _ = scripted_link(answer)
    for _ in range(3):
        link.request(c.ReadStatus(), c.Status)
    trips = link.counters.round_trips
    assert trips.count == 2
    assert trips.mean_s == pytest.approx(0.004)
    assert trips.p99_s == pytest.approx(0.004, rel=0.1)
    assert trips.max_s == pytest.approx(0.004)


def test_after_the_channel_has_ended_nothing_is_asked_until_reconnected() -> None:
    first = ScriptedChannel(lambda _sequence, _request: [])
    second = ScriptedChannel(says(STATUS))
    endpoint = ScriptedEndpoint([first, second])
    link = Link(endpoint, now=first.now, chance=Zeros())
    first.broken = "cable pulled"
    for _ in range(2):
        with pytest.raises(LinkLostError, match="cable pulled"):
            link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.LOST
    assert not first.asked
    link.reconnect()
    assert not second.asked, "a new channel is opened and nothing is sent over it"
    assert link.request(c.ReadStatus(), c.Status) == STATUS
    assert second.asked[0][0] == 1, "numbers go on: an old reply is never taken for a new one"
    assert link.counters.reconnections == 1


def test_nothing_of_an_ended_channel_reaches_the_next() -> None:
    # Connecting again ends the old channel even one that still works
    first, second = ScriptedChannel(says(STATUS)), ScriptedChannel(says(STATUS))
    link = Link(ScriptedEndpoint([first, second]), now=first.now, chance=Zeros())
    link.request(c.ReadStatus(), c.Status)
    link.reconnect()
    assert first.broken == "closed"
    link.request(c.ReadStatus(), c.Status)
    assert (len(first.asked), len(second.asked)) == (1, 1)

    # Half a reply is forgotten with the channel it came over
    def breaks_off(sequence: int, _request: Request) -> list[tuple[float, bytes]]:
        if len(first.asked) > 1:
            first.broken = "cable pulled"
        return [(0.0, frame_of(sequence, STATUS)[:6])]

    first = ScriptedChannel(breaks_off)
    second = ScriptedChannel(says(STATUS))
    link = Link(ScriptedEndpoint([first, second]), now=first.now, chance=Zeros())
    with pytest.raises(LinkLostError, match="cable pulled"):
        link.request(c.ReadStatus(), c.Status)
    link.reconnect()
    assert link.request(c.ReadStatus(), c.Status) == STATUS
    assert link.counters.damaged == 0


class _EndsAtTheWrite(ScriptedChannel):
    """A channel of which nobody knew before the write that it had ended."""

    def write(self, data: bytes) -> None:
        self.broken = self.broken or "cable pulled"
        super().write(data)


def test_a_reply_to_a_request_that_could_not_be_written_is_nobody_s() -> None:
    def answers_an_older_request_too(sequence: int, _: Request) -> list[tuple[float, bytes]]:
        return [(0.0, frame_of(sequence - 1, STATUS) + frame_of(sequence, STATUS))]

    first = _EndsAtTheWrite(lambda _sequence, _request: [])
    second = ScriptedChannel(answers_an_older_request_too)
    link = Link(ScriptedEndpoint([first, second]), now=first.now, chance=Zeros())
    with pytest.raises(LinkLostError, match="cable pulled"):
        link.request(c.ReadStatus(), c.Status)
    link.reconnect()
    assert link.request(c.ReadStatus(), c.Status) == STATUS
    assert (link.counters.stale, link.counters.duplicates) == (1, 0)


def test_a_second_reply_is_known_for_the_last_256_requests() -> None:
    pending = PendingReplies(Tally(), first=SEQUENCE_NUMBERS + 0xFFFE)
    assert [pending.begin(c.ReadStatus()).sequence for _ in range(4)] == [0xFFFE, 0xFFFF, 0, 1]
    pending = PendingReplies(Tally())
    waiting = pending.begin(c.ReadStatus())
    for _ in range(SEQUENCE_NUMBERS - 1):
        pending.forget(pending.begin(c.ReadStatus()))
    assert (waiting.sequence, pending.begin(c.ReadStatus()).sequence) == (0, 1)
    tally = Tally()
    pending = PendingReplies(tally)
    for _ in range(257):
        assert pending.match(pending.begin(c.ReadStatus()).sequence, STATUS, 0.0) is not None
    for sequence, counted in ((1, (0, 1)), (0, (1, 1)), (256, (1, 2))):
        assert pending.match(sequence, STATUS, 0.0) is None
        found = tally.snapshot(damaged=0)
        assert (found.stale, found.duplicates) == counted


def test_a_second_refusal_is_a_duplicate_too_and_another_reply_under_its_number_is_stale() -> None:
    tally = Tally()
    pending = PendingReplies(tally)
    sequence = pending.begin(c.ReadStatus()).sequence
    found = pending.match(sequence, c.Refused(c.ReadStatus.OPCODE, c.Refusal.FROZEN), 7.5)
    assert found is not None
    assert (found.answered_at, found.written, found.written_at, found.deadline) == (7.5, 0, 0.0, 0.0)
    assert pending.match(sequence, c.Refused(c.ReadStatus.OPCODE, c.Refusal.FROZEN), 8.0) is None
    assert pending.match(sequence, TAKEN, 8.0) is None
    other = pending.begin(c.ReadStatus()).sequence
    assert pending.match(other, c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.FROZEN), 8.0) is None
    counted = tally.snapshot(damaged=0)
    assert (counted.duplicates, counted.stale, counted.requests) == (1, 2, 2)


def greeted(*replies: c.HelloReply) -> c.HelloReply | None:
    """What a greeting with nonce 5 takes for its answer."""
    pending = PendingReplies(Tally())
    sequence = pending.begin(c.Hello(c.PROTOCOL_VERSION, 5)).sequence
    found = [pending.match(sequence, reply, 0.0) for reply in replies]
    return next((one.reply for one in found if one is not None), None)  # type: ignore[return-value]


def test_a_greeting_is_answered_by_its_own_nonce_which_is_the_time_in_lock_step() -> None:
    # A greeting is answered by its own nonce or by another version
    own = c.HelloReply(c.PROTOCOL_VERSION, c.Capability.SAMPLE, 20_000, 8, 3, 5, 7)
    replayed = c.HelloReply(c.PROTOCOL_VERSION, c.Capability.SAMPLE, 20_000, 8, 3, 6, 7)
    short = c.HelloReply(c.PROTOCOL_VERSION, c.Capability.SAMPLE, 20_000, 8, 3)
    newer = c.HelloReply(c.PROTOCOL_VERSION + 1, c.Capability.SAMPLE, 20_000, 8, 3)
    assert greeted(replayed, short, own) == own
    assert greeted(newer) == newer
    assert greeted(replayed, short) is None

    # In lock step the nonce is the controller's time so that a run repeats to the bit
    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        if isinstance(request, c.Advance):
            return [(0.0, frame_of(sequence, c.Advanced(3 * 2**32 + 2**32 - 2, 0)))]
        assert isinstance(request, c.Hello)
        return [(0.0, frame_of(sequence, c.HelloReply(2, c.Capability.LOCK_STEP, 20_000, 0, 1, request.nonce, 7)))]

    link, channel = scripted_link(answer, lock_step=True)
    link.greet()
    assert [type(request).__name__ for _, request in channel.asked] == ["Advance", "Hello"]
    assert channel.asked[1][1] == c.Hello(2, 2**32 - 2)
    # A controller in lock step that knows no time is greeted all the same
    refused = c.Refused(c.Advance.OPCODE, c.Refusal.NOT_CAPABLE)
    hello = c.HelloReply(1, c.Capability.LOCK_STEP, 20_000, 0, 1)
    link, _ = scripted_link(says(lambda request: refused if isinstance(request, c.Advance) else hello), lock_step=True)
    assert link.greet().version == 1
    assert link.counters.refused == 1


def test_a_link_is_clean_again_after_a_hundred_good_replies() -> None:
    link, _ = scripted_link(once_silent(STATUS, RETRIES + 1))
    with pytest.raises(LinkTimeoutError):
        link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.LOST
    link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.CONNECTED, "nothing had to be repeated since"
    assert link.counters.timeouts == RETRIES + 1
    assert link.counters.retries == RETRIES
    first, second = ScriptedChannel(says(STATUS)), ScriptedChannel(says(STATUS))
    link = Link(ScriptedEndpoint([first, second]), now=first.now, chance=Zeros())
    link.reconnect()
    assert link.state is LinkState.DEGRADED
    for _ in range(100):
        assert link.state is LinkState.DEGRADED
        link.request(c.ReadStatus(), c.Status)
    assert link.state is LinkState.CONNECTED


class _Waits:
    """Ends the attempts after the delays it was asked for; never sleeps."""

    def __init__(self, attempts: int) -> None:
        self.delays: list[float] = []
        self._attempts = attempts

    def wait(self, timeout: float) -> bool:
        self.delays.append(timeout)
        return len(self.delays) > self._attempts


def test_reconnection_waits_twice_as_long_each_time_and_may_be_given_up() -> None:
    channel = ScriptedChannel(lambda _sequence, _request: [])
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    waits = _Waits(9)
    with pytest.raises(LinkLostError, match="not connected again: nobody there"):
        link.reconnect(waits)
    assert waits.delays == [0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0]
    channel = ScriptedChannel(lambda _sequence, _request: [])
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    with pytest.raises(LinkLostError, match=r"^not connected again: not tried$"):
        link.reconnect(_Waits(0))
    assert link.counters.reconnections == 0


@given(
    fates=st.lists(st.sampled_from(["answer", "lose", "twice", "late", "damage", "foreign"]), max_size=60),
    addresses=st.lists(st.integers(0, 0xFFF0), min_size=1, max_size=12),
)
def test_whatever_happens_to_replies_each_request_gets_its_own_or_none(fates: list[str], addresses: list[int]) -> None:
    script = iter(fates)

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        reply = frame_of(sequence, right_reply(request))
        match next(script, "answer"):
            case "lose":
                return []
            case "twice":
                return [(0.001, reply), (0.002, reply)]
            case "late":
                return [(0.120, reply)]
            case "damage":
                return [(0.001, bytes((*reply[:4], reply[4] ^ 1, *reply[5:])))]
            case "foreign":
                return [(0.001, frame_of((sequence + 1) % 0x10000, c.Block(b"\xee\xee"))), (0.001, reply)]
            case _:
                return [(0.001, reply)]

    link, _ = scripted_link(answer)
    for address in addresses:
        try:
            block = link.request(c.ReadBlock(address, 4), c.Block)
        except LinkTimeoutError:
            continue
        assert block.data == address.to_bytes(2, "little") * 2
