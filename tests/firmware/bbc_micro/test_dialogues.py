"""The dialogues of vectors.json with the image for the BBC Micro, on its own line and in its own time."""

import json
from random import Random
from typing import Any

import pytest

from tests.firmware.bbc_micro import needs

needs.require()

from tests.firmware.bbc_micro.partner import BbcPartner  # noqa: E402
from tests.protocol.make_vectors import FILE  # noqa: E402
from tests.protocol.play import play  # noqa: E402

DIALOGUES: list[dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["dialogues"]
QUICK = {
    "a stop holds until it is released by its number",
    "the turn for slow lines writes set points and asks for a sample in one frame",
}


@pytest.mark.parametrize(
    "dialogue",
    [
        pytest.param(one, id=one["rule"], marks=() if one["rule"] in QUICK else pytest.mark.slow)
        for one in DIALOGUES
        if "LOCK_STEP" not in one["needs"]
    ],
)
def test_the_image_passes_the_dialogues(dialogue: dict[str, Any]) -> None:
    partner, chance = BbcPartner(), Random(dialogue["rule"])
    play(dialogue["steps"], partner, lambda: chance.getrandbits(32))
    assert partner.bbc.serial.overruns == 0


@pytest.mark.slow
@pytest.mark.parametrize("dialogue", DIALOGUES[:6], ids=lambda one: one["rule"])
def test_the_image_for_9600_baud_passes_them_too(dialogue: dict[str, Any]) -> None:
    partner, chance = BbcPartner("BRIDG96"), Random(dialogue["rule"])
    assert partner.bbc.serial.baud == 9600
    play(dialogue["steps"], partner, lambda: chance.getrandbits(32))
