"""The Mega's firmware image on a simulated board: what it does on the line, on the bus, and with a freeze."""

import json
from itertools import count
from typing import Any

import pytest

from benchmarks.bridge_in_c import Host
from firmware_protocol import commands as c
from firmware_protocol.framing import Frame, FrameDecoder
from mock_controller.device import build_device
from mock_controller.options import Options
from tests.firmware.compiled import need, need_simavr
from tests.firmware.mega_link import MegaLink, board_on_the_bus
from tests.protocol.make_vectors import FILE
from tests.protocol.play import play

pytestmark = pytest.mark.slow
PERIOD_US = 20_000


@pytest.fixture
def link() -> MegaLink:
    """A new board, whose EEPROM is empty."""
    need("gcc", "avr-gcc", "make")
    need_simavr()
    return MegaLink(build_device(board_on_the_bus(Options(tcp="nowhere:0")), lambda _: None))


@pytest.fixture
def new_host(link: MegaLink) -> Host:
    """A host that has greeted a new board."""
    host = Host(link, line_is_modelled=True)
    host.run_until(5 * PERIOD_US)
    host.greet()
    return host


@pytest.fixture
def host(new_host: Host) -> Host:
    """A host whose board has been released."""
    new_host.release()
    return new_host


def test_a_new_board_starts_frozen_and_is_released(new_host: Host) -> None:
    status: Any = new_host.ask(c.ReadStatus())
    assert status.status & c.StatusFlag.FROZEN
    assert status.stop > 0
    new_host.release()
    assert not new_host.ask(c.ReadStatus()).status & c.StatusFlag.FROZEN


class Port:
    """The image as the partner of a dialogue."""

    def __init__(self, link: MegaLink) -> None:
        self._link = link
        self._decoder = FrameDecoder()
        self._said: list[Frame] = []

    def send(self, data: bytes) -> None:
        self._link.receive(data)

    def _pass_time(self, us: int) -> None:
        self._link.run_until(self._link.time_us + us)
        self._said += self._decoder.feed(self._link.take_output())

    def reply(self, sequence: int) -> Frame:
        for _ in range(100):
            if self._said:
                assert self._said[0].sequence == sequence
                return self._said.pop(0)
            self._pass_time(500)
        raise AssertionError("no reply")

    def happens(self, event: str) -> None:
        if event == "bridge":
            self._link.simulator.reset()
        self._pass_time(PERIOD_US)

    def rest(self) -> list[Frame]:
        self._pass_time(PERIOD_US)
        return self._said


def test_the_dialogue_of_a_bridge_that_starts_again_goes_as_written(link: MegaLink) -> None:
    dialogues = json.loads(FILE.read_text("utf-8"))["dialogues"]
    (dialogue,) = [each for each in dialogues if "RESTART" in each["needs"]]
    nonces = count(0x5EED0000)
    link.run_until(5 * PERIOD_US)
    play(dialogue["steps"], Port(link), lambda: next(nonces))


def test_a_freeze_outlasts_the_loss_of_power(host: Host, link: MegaLink) -> None:
    host.greet()
    host.ask(c.Stop())
    stop = host.ask(c.ReadStatus()).stop
    host.run_until(link.time_us + PERIOD_US)
    link.simulator.reset()
    host.run_until(link.time_us + 5 * PERIOD_US)
    status: Any = host.ask(c.ReadStatus())
    assert status.status == c.StatusFlag.FROZEN | c.StatusFlag.RESTARTED
    assert status.stop >> 16 == (stop >> 16) + 1, "a number that was never given before"
    assert status.boots == 1
    host.greet()
    host.release()


def test_it_follows_the_controller_without_costing_it_a_set_point(host: Host, link: MegaLink) -> None:
    missed = link.board.counters.set_points_missed
    snapshot = host.ask(c.Sample(c.AFTER_NEWEST, 0x3F))
    for step in range(20):
        postures = tuple((joint, reading.set_point + (1 if step % 2 else -1)) for joint, reading in snapshot.joints)
        host.ask(c.WriteSetPoints(postures))
        later = host.ask(c.Sample(snapshot.tick, 0x3F))
        assert later.tick == snapshot.tick + 1
        snapshot = later
    assert link.board.counters.set_points_missed == missed
    assert host.ask(c.ReadStatus()).missed == 0


def test_every_cycle_and_every_byte_of_the_bus_is_as_published(host: Host, link: MegaLink) -> None:
    before = link.simulator.bus.reads
    host.ask(c.ReadBlock(0xFC00, 48))
    host.ask(c.Stop())
    host.release()
    bus = link.simulator.bus
    assert bus.reads - before >= 48
    assert bus.writes >= 12
    assert bus.broken == {}
    assert bus.least_select_setup_ns >= 250 + 2 * 62, "two clocks to spare"
    host.ask(c.SetGains(6, 3, 1, 2))
    assert link.board.memory.values("gain_p")[5] == 3
    assert host.ask(c.ReportGains()).gains[5] == (3, 1, 2)
    data = host.ask(c.ReadBlock(0xFC50, 24)).data
    assert data == bytes(link.board.memory.get(0xFC50 + place) for place in range(24))
