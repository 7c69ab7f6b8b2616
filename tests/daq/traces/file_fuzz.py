"""Files of every kind that is read, damaged at random: what a reader does with them.

Nothing may end in another error than DaqError, in one line of bounded length; and what is read of a trace is the whole
of what the file has, or its notes say what is missing. The files of traces themselves have `trace_damage`.
"""

import itertools
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daq.config.robot_files import load_memory_map
from daq.config.settings import load_settings
from daq.contracts.documents import read_document
from daq.contracts.errors import DaqError
from daq.contracts.experiment import ExperimentSpec, parse_spec
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq.teaching.program import load_program
from daq.traces.csv_table import import_csv
from model.machine_model.model import base_model
from model.machine_model.model_file import load_model, save_model
from tests.daq.traces.damaged_traces import AT_RANDOM, Tally

CASES = 60_000
ROWS = 60
LONGEST_LINE = 1000
"""Most characters of an error, its file's path among them."""
LIMITS = TraceLimits(file_bytes=1 << 24, chunk_bytes=1 << 22, total_bytes=1 << 24)
"""No file here has a hundredth of it, so that a length that is a lie is refused and not allocated."""
PROGRAM = b"""name = "a"
instructions = [
  {kind = "absolute", angles = {1 = 2.5, 2 = 2.1}, speed = 0.3},
  {kind = "wait", duration = 2.0},
]
"""
HOME = Path(__file__).parents[3]

Read = Callable[[Path], Any]
Damage = Callable[[random.Random, bytes], bytes]


@dataclass(frozen=True)
class Kind:
    """A kind of file: what is opened, the file of it that is damaged and its sound content, and the reader."""

    name: str
    opened: Path
    damaged: Path
    read: Read
    data: bytes


# ---- damage of texts, beside that of disks


def _inserted(piece: Callable[[random.Random], bytes]) -> Damage:
    def damage(rng: random.Random, data: bytes) -> bytes:
        at = rng.randrange(len(data) + 1)
        return data[:at] + piece(rng) + data[at:]

    return damage


def _number(rng: random.Random, data: bytes) -> bytes:
    """A digit becomes a number beyond measure."""
    digits = [at for at, byte in enumerate(data) if 48 <= byte <= 57]
    if not digits:
        return data + b"9"
    at = rng.choice(digits)
    number = rng.choice((b"1e308", b"-1e999", b"9" * 5000, b"nan", b"0x1", b"1_0", b"-0", b"inf", b"2147483648"))
    return data[:at] + number + data[at + 1 :]


def _encoded(rng: random.Random, data: bytes) -> bytes:
    """The same text in another encoding, or with a byte-order mark."""
    text = data.decode("utf-8", "replace")
    encoding = rng.choice(("utf-8-sig", "utf-16", "utf-16-be", "utf-32", "latin-1", "cp037"))
    return text.encode(encoding, "replace")


DAMAGES: dict[str, Damage] = {
    **AT_RANDOM,
    "NULs put in": _inserted(lambda rng: bytes(rng.choice((1, 3, 100_000)))),
    "characters put in": _inserted(lambda rng: rng.choice((b"[", b"{", b'"', b"<", b"\n", b",", b"=", b"]" * 5000))),
    "nested deeply": _inserted(lambda rng: rng.choice((b"[", b'{"a":', b"<a>")) * rng.choice((100, 20_000))),
    "numbers beyond measure": _number,
    "other encodings": _encoded,
}


# ---- files


def _texts(folder: Path) -> dict[str, tuple[bytes, Read]]:
    """Content and reader of each kind of text."""
    rows = b"".join(b"%.2f,0.5,%.6f,%.3f\n" % (0.01 * k, 0.01 * k, k - 30) for k in range(ROWS))
    settings = b'[robot]\nport = "mock://"\n[server]\nport = 8300\nnames = ["a"]\n[traces.limits]\njoints = 6\n'
    model = save_model(base_model(load_machine("ma2000")), folder / "model.json")

    def machine(path: Path) -> Machine:
        return load_machine(str(path))

    def spec(path: Path) -> ExperimentSpec:
        return parse_spec(read_document(path, str(path)), str(path))

    return {
        "rig.csv": (b"time,set_point_1,position_1,drive_1\n" + rows, lambda path: import_csv(path, LIMITS)),
        "machine.toml": ((HOME / "daq/contracts/machines/ma2000.toml").read_bytes(), machine),
        "pendulum.toml": ((HOME / "examples/double_pendulum.toml").read_bytes(), machine),
        "daq.toml": (settings, load_settings),
        "program.toml": (PROGRAM, load_program),
        "map.toml": ((HOME / "firmware_protocol/memory_map.toml").read_bytes(), load_memory_map),
        "spec.json": (ExperimentSpec().model_dump_json(indent=1).encode(), spec),
        "spec.toml": (b'joints = [1, 2]\n[trajectory]\nkind = "ramp"\n', spec),
        "model.json": (model.read_bytes(), load_model),
    }


def kinds(folder: Path) -> list[Kind]:
    """A sound file of every kind, each in a folder of its own."""
    found = []
    for name, (data, read) in _texts(folder).items():
        own = folder / name.replace(".", " ")
        own.mkdir()
        (own / name).write_bytes(data)
        found.append(Kind(name, own / name, own / name, read, data))
    return found


# ---- what comes of it


class Campaign:
    """Damaged files, one after the other."""

    def __init__(self, kinds: list[Kind]) -> None:
        self.kinds = kinds
        self.tally = Tally()
        self._sound = {kind.name: kind.read(kind.opened) for kind in self.kinds}

    def run(self, cases: Iterator[tuple[Kind, str, bytes]]) -> Tally:
        for kind, way, data in cases:
            kind.damaged.write_bytes(data)
            self._case(kind, way, data)
            kind.damaged.write_bytes(kind.data)
        return self.tally

    def _case(self, kind: Kind, way: str, data: bytes) -> None:
        try:
            found = kind.read(kind.opened)
        except DaqError as error:
            first, *others = str(error).split("\n")
            counted = re.search(r": (\d+) mistakes$", first)  # a machine file's, all at once, a line each
            if len(others) != (int(counted[1]) if counted else 0) or max(map(len, (first, *others))) > LONGEST_LINE:
                self.tally.fault("errors of several or endless lines", f"{kind.name}, {way}", str(error))
            self.tally.ends["refused"] += 1
        except Exception as error:  # noqa: BLE001  # that is what is counted
            self.tally.fault("other exceptions", f"{kind.name}, {way}", repr(error))
        else:
            self.tally.ends["read"] += 1
            if isinstance(found, Trace):
                self._judge(kind, way, data, found)

    def _judge(self, kind: Kind, way: str, data: bytes, found: Trace) -> None:
        """A CSV has no checksums: it is held against its own rows. A bag is held against what was written."""
        if kind.name == "rig.csv":
            lines = [line for line in data.removeprefix(b"\xef\xbb\xbf").replace(b"\r", b"\n").split(b"\n") if line]
            expected = len(lines) - 1
        else:
            expected = ROWS
        said = "INCOMPLETE" in found.record.notes or "left out" in found.record.notes
        if len(found) < expected and not said:
            self.tally.fault("samples lost without a word", f"{kind.name}, {way}", f"{len(found)} of {expected}")
        if kind.name == "bag of MCAP" and not set(found.position[:, 0]) <= set(self._sound[kind.name].position[:, 0]):
            self.tally.fault("wrong samples", f"{kind.name}, {way}", found.record.notes)


def damaged(chosen: list[Kind], rng: random.Random) -> Iterator[tuple[Kind, str, bytes]]:
    """An endless sequence: each kind and each way in turn."""
    while True:
        for kind in chosen:
            for way, damage in DAMAGES.items():
                yield kind, way, damage(rng, kind.data)


def campaign(cases: int, seed: int, kinds: list[Kind]) -> Tally:
    running = Campaign(kinds)
    return running.run(itertools.islice(damaged(running.kinds, random.Random(seed)), cases))
