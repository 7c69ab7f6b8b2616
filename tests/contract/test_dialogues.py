"""The dialogues of vectors.json with every controller at a port: sessions, stops, ring, waiting samples, restarts."""

import json
import time
from collections.abc import Iterator
from contextlib import closing
from random import SystemRandom
from typing import Any

import pytest

from daq.driver import Controller
from daq.transport import ByteChannel
from firmware_protocol.commands import Capability
from firmware_protocol.framing import Frame, FrameDecoder
from tests.contract.conftest import BRIDGES, MOCKS, UnderContract
from tests.control_port import told_by
from tests.protocol.make_vectors import FILE
from tests.protocol.play import play

REPLY_S = 5.0
QUIET_S = 0.02
DIALOGUES: list[dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["dialogues"]
PLAYED = [dialogue for dialogue in DIALOGUES if "RESTART" not in dialogue["needs"]]
"""All but the restart of a bridge: a mock's port ends with its process. tests/protocol/test_vectors.py plays it with
the mock's bridge and with a second one."""
pytestmark = pytest.mark.motion


class Port:
    """A controller at a port as the partner of a dialogue."""

    def __init__(self, channel: ByteChannel, control: str | None) -> None:
        self._channel = channel
        self._control = control
        self._decoder = FrameDecoder()
        self._said: list[Frame] = []

    def send(self, data: bytes) -> None:
        self._channel.write(data)

    def reply(self, sequence: int) -> Frame:
        while not self._said:
            data = self._channel.read(REPLY_S)
            assert data, "no reply"
            self._said += self._decoder.feed(data)
        assert self._said[0].sequence == sequence
        return self._said.pop(0)

    def happens(self, event: str) -> None:
        """A period ends by itself; a reset takes its time."""
        if event != "reset":
            return
        boots = told_by(self._control, "state")["boots"]
        told_by(self._control, "brown_out")
        while told_by(self._control, "state")["boots"] == boots:
            pass  # each question takes some of its time

    def rest(self) -> list[Frame]:
        ends = time.monotonic() + QUIET_S
        while (left := ends - time.monotonic()) > 0:
            self._said += self._decoder.feed(self._channel.read(left))
        return self._said


@pytest.fixture(scope="module")
def abilities(under_contract: UnderContract) -> set[str]:
    """What dialogues may need of a controller, as far as this one has it."""
    with Controller.connect(under_contract.url) as controller:
        capabilities = controller.identity.capabilities
    clock = Capability.LOCK_STEP not in capabilities
    return {
        *(["SAMPLE"] if Capability.SAMPLE in capabilities else []),
        *(["COMPACT"] if Capability.COMPACT in capabilities else []),
        *(["CLOCK"] if clock else []),
        *(["RESET"] if clock and under_contract.control else []),
    }


@pytest.fixture
def port(under_contract: UnderContract, abilities: set[str]) -> Iterator[Port]:
    with closing(under_contract.channel()) as channel:
        while channel.read(QUIET_S):
            pass  # late replies to what the connection before asked twice
        yield Port(channel, under_contract.control)


def _cases() -> Iterator[Any]:
    """Each mock with the dialogues that it has the abilities for; a real controller with all: it skips visibly."""
    for name, options in {**MOCKS, **{name: " ".join(arguments) for name, arguments in BRIDGES.items()}}.items():
        lacks = {"CLOCK", "RESET"} if "lock_step" in options else set()
        lacks |= {"SAMPLE", "COMPACT"} if "no_sample" in options or "no-sample" in options else set()
        lacks |= {"COMPACT"} if name in BRIDGES else set()  # the core in C, for lines of 115200 baud, goes without
        marks = [pytest.mark.slow] if name in BRIDGES else []
        for dialogue in PLAYED:
            if not lacks & set(dialogue["needs"]):
                yield pytest.param(name, dialogue, id=f"{name}-{dialogue['rule']}", marks=marks)
    for dialogue in PLAYED:
        yield pytest.param("hardware", dialogue, id=f"hardware-{dialogue['rule']}", marks=pytest.mark.hardware)


CASES = list(_cases())
WITH_MOCKS = [case.values[1] for case in CASES if case.values[0] in MOCKS]
assert all(dialogue in WITH_MOCKS for dialogue in PLAYED), "a dialogue that no mock can play"


@pytest.mark.parametrize(("under_contract", "dialogue"), CASES, indirect=["under_contract"], scope="module")
def test_a_dialogue_goes_as_written(dialogue: dict[str, Any], port: Port, abilities: set[str]) -> None:
    missing = set(dialogue["needs"]) - abilities
    if missing:  # of a mock this is an error where CI is set
        pytest.skip(f"this controller has no {', '.join(sorted(missing))}")
    chance = SystemRandom()
    play(dialogue["steps"], port, lambda: chance.getrandbits(32))
