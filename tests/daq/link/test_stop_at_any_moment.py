"""A stop from one thread while another waits for a sample: written at once, confirmed by itself."""

import threading
from concurrent.futures import ThreadPoolExecutor
from queue import Empty, SimpleQueue
from typing import Any

import pytest

from daq.link import Link, StopCameFirstError
from firmware_protocol import commands as c
from firmware_protocol.framing import FrameDecoder
from firmware_protocol.joints import JointReading
from firmware_protocol.message import Request
from firmware_protocol.session import parse_request
from tests.daq.link.scripted import frame_of

PATIENCE = 60.0
"""Period (s) of the links: how long a request waits by itself for a reply that does not come."""
WITHIN = 20.0
"""Time (s) within which a thread is woken by a reply, on a machine that does much else: sooner than by its patience."""
STOPPED = c.Stopped(9, (500, 501, 502, 503, 504, 505))
SNAPSHOT = c.Snapshot(10, 1, ((1, JointReading(500, 2048, 0, 0)),))


class SampleWaitsForStop:
    """Answers a sample only when a stop has been answered before."""

    description = "bench"
    lock_step = False
    url = "bench://"
    bytes_per_second = 11520.0
    control = None

    def __init__(self) -> None:
        self.sample_waits = threading.Event()
        self.order: list[type[Request]] = []
        self._decoder = FrameDecoder()
        self._sample: int | None = None
        self._replies: SimpleQueue[bytes] = SimpleQueue()

    def waited(self) -> float:
        return 0.0

    def connect(self) -> "SampleWaitsForStop":
        return self

    def write(self, data: bytes) -> None:
        for frame in self._decoder.feed(data):
            request = parse_request(frame)
            self.order.append(type(request))
            if isinstance(request, c.Sample):
                self._sample = frame.sequence
                self.sample_waits.set()
            elif isinstance(request, c.Stop):
                self._replies.put(frame_of(frame.sequence, STOPPED))
            elif isinstance(request, c.SetGripper):
                self._replies.put(frame_of(frame.sequence, c.GripperSet()))

    def answer_sample(self) -> None:
        assert self._sample is not None
        self._replies.put(frame_of(self._sample, SNAPSHOT))

    def read(self, timeout_s: float) -> bytes:
        try:
            return self._replies.get(timeout=timeout_s)
        except Empty:
            return b""

    def close(self) -> None:
        """Nothing to close."""


def test_a_stop_overtakes_a_waiting_sample_and_the_sample_still_arrives() -> None:
    bench = SampleWaitsForStop()
    link = Link(bench)
    link.set_period(PATIENCE)  # the sample's own patience does not come into it
    samples: list[c.Snapshot] = []
    sampler = threading.Thread(target=lambda: samples.append(link.request(c.Sample(9, 1), c.Snapshot)))
    sampler.start()
    assert bench.sample_waits.wait(WITHIN)
    assert link.stop() == STOPPED
    assert not samples
    bench.answer_sample()
    sampler.join(WITHIN)
    assert samples == [SNAPSHOT]
    assert bench.order[:3] == [c.Sample, c.Stop, c.Stop]
    assert set(bench.order[3:]) <= {c.Stop}, "asked again where the machine is busy"


def test_while_one_thread_reads_another_that_waits_does_not_read() -> None:
    class SlowToConfirm(SampleWaitsForStop):
        readers = most_readers = 0
        confirmation: threading.Timer | None = None
        _counting = threading.Lock()

        def write(self, data: bytes) -> None:
            for frame in self._decoder.feed(data):
                if isinstance(parse_request(frame), c.Sample):
                    self._sample = frame.sequence
                    self.sample_waits.set()
                elif self.confirmation is None:
                    reply = frame_of(frame.sequence, STOPPED)
                    self.confirmation = threading.Timer(0.05, self._replies.put, (reply,))
                    self.confirmation.start()

        def read(self, timeout_s: float) -> bytes:
            with self._counting:
                self.readers += 1
                self.most_readers = max(self.most_readers, self.readers)
            try:
                return super().read(timeout_s)
            finally:
                with self._counting:
                    self.readers -= 1

    bench = SlowToConfirm()
    link = Link(bench)
    link.set_period(PATIENCE)
    sampler = threading.Thread(target=lambda: link.request(c.Sample(9, 1), c.Snapshot))
    sampler.start()
    assert bench.sample_waits.wait(WITHIN)
    assert link.stop() == STOPPED
    bench.answer_sample()
    sampler.join(WITHIN)
    assert bench.confirmation is not None
    bench.confirmation.join(WITHIN)
    assert bench.most_readers == 1


def test_a_reply_that_another_thread_has_read_is_handed_on_at_once() -> None:
    class TwoSamples(SampleWaitsForStop):
        def __init__(self) -> None:
            super().__init__()
            self.sequences: SimpleQueue[int] = SimpleQueue()

        def write(self, data: bytes) -> None:
            for frame in self._decoder.feed(data):
                self.sequences.put(frame.sequence)

        def answer(self, sequence: int) -> None:
            self._replies.put(frame_of(sequence, SNAPSHOT))

    bench = TwoSamples()
    link = Link(bench)
    link.set_period(PATIENCE)  # the patience of both
    threads = [threading.Thread(target=link.request, args=(c.Sample(9, 1), c.Snapshot), daemon=True) for _ in range(2)]
    numbers = []
    for thread in threads:
        thread.start()
        numbers.append(bench.sequences.get(timeout=WITHIN))
    reply = threading.Timer(0.05, bench.answer, (numbers[1],))
    reply.start()
    threads[1].join(WITHIN)
    assert not threads[1].is_alive(), "woken by the reply and not by its own patience"
    bench.answer(numbers[0])
    threads[0].join(WITHIN)
    reply.join(WITHIN)


def test_many_threads_share_one_link_and_each_gets_its_own_reply() -> None:
    class Echo(SampleWaitsForStop):
        def write(self, data: bytes) -> None:
            for frame in self._decoder.feed(data):
                request = parse_request(frame)
                assert isinstance(request, c.Sample)
                self._replies.put(frame_of(frame.sequence, c.Snapshot(request.after + 1, 0, SNAPSHOT.joints)))

    link = Link(Echo())
    wrong: list[int] = []

    def ask(first: int) -> None:
        ticks = range(first, first + 200)
        wrong.extend(after for after in ticks if link.request(c.Sample(after, 1), c.Snapshot).tick != after + 1)

    threads = [threading.Thread(target=ask, args=(1000 * number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert not wrong
    assert link.counters.requests == 1200
    assert link.counters.retries == 0


class WriteLock:
    """The lock of the line, where the first of two threads goes on only when the second one waits for it."""

    def __init__(self) -> None:
        self.is_first_in = threading.Event()
        self._lock = threading.Lock()
        self._second_waits = threading.Event()

    def __enter__(self) -> None:
        if self.is_first_in.is_set():
            self._second_waits.set()
            self._lock.acquire()
            return
        self._lock.acquire()
        self.is_first_in.set()
        assert self._second_waits.wait(WITHIN)

    def __exit__(self, *_: object) -> None:
        self._lock.release()


@pytest.mark.parametrize("stop_is_first", [True, False])
def test_what_was_allowed_before_a_stop_of_another_thread_is_never_written_behind_it(stop_is_first: bool) -> None:
    bench, lock = SampleWaitsForStop(), WriteLock()
    link = Link(bench)
    link.set_period(PATIENCE)
    link._connection._write_lock = lock  # type: ignore[assignment]

    def close_the_gripper(stops: int) -> c.GripperSet:
        return link.request(c.SetGripper(1), c.GripperSet, before_stop=stops)

    with ThreadPoolExecutor(2) as pool:
        orders: list[Any] = [(link.stop,), (close_the_gripper, link.stops)]
        first, second = orders if stop_is_first else orders[::-1]
        begun = pool.submit(*first)
        assert lock.is_first_in.wait(WITHIN)
        followed = pool.submit(*second)
        stopped, closed = (begun, followed) if stop_is_first else (followed, begun)
        assert stopped.result(WITHIN) == STOPPED
        if stop_is_first:
            assert isinstance(closed.exception(WITHIN), StopCameFirstError)
        else:
            assert closed.result(WITHIN) == c.GripperSet()
    assert bench.order == [c.SetGripper] * (not stop_is_first) + 2 * [c.Stop]  # which is written twice at once
