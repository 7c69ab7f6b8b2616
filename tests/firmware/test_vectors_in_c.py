"""The core in C finds every vector of vectors.json true, and says to the byte what the second bridge says."""

from __future__ import annotations

import json
from collections.abc import Iterator
from random import Random
from typing import Any

import pytest

from firmware_protocol import commands as c
from firmware_protocol.framing import FrameDecoder, encode_frame
from tests.firmware.bench import Bench, partner
from tests.firmware.compiled import need
from tests.firmware.core import PeriodSource
from tests.protocol.make_vectors import FILE
from tests.protocol.play import play
from tests.protocol.second_bridge import SecondBridge
from tests.protocol.second_implementation import frame_of

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))
DIALOGUES: list[dict[str, Any]] = VECTORS["dialogues"]
REQUESTS = [vector for vector in VECTORS["frames"] if c.KINDS_OF_REQUEST]  if hasattr(c, "KINDS_OF_REQUEST") else VECTORS["frames"]
