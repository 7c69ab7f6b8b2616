"""Registration of a trial before it is run: cases, experiments, and hashes of the code under trial."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from hashlib import sha256
from typing import Annotated, Literal

from pydantic import Field, ValidationError, field_validator

from daq.contracts.documents import parse_toml, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from firmware_protocol.invalid import first_invalid
from model.trial.truth import DETECTABLE

Experiment = Literal["diagnostic", "ramp"]


# --- The arms of a trial: the mock's seeds, 100·number + 10·kind + load, and how a registration draws them


KINDS: dict[str, int] = {"clean": 1, "single": 2, "open-set": 3, "pair": 4, "shared": 5, "wrong-priors": 6, "later": 7}
"""Kinds of arms, and the digit of each in a secret."""
LOADS: dict[str, int] = {"nominal": 0, "light": 1, "heavy": 2}
"""Announced loads, and the digit of each in a secret."""
LOAD_CYCLE = ("nominal", "nominal", "nominal", "light", "heavy")
"""Loads of arms, in turn by their number."""
LARGEST_NUMBER = 10**15
"""Largest number of an arm: those that a commit draws have 48 bits."""
MOST_NUMBERS = 100_000
"""Most arms of one trial; a case takes a minute, so this is months."""
_FIRST_DRAWN = 10**6
"""Smallest number that a commit draws; smaller ones are for tuning and tests."""


def parse_numbers(text: str) -> list[int]:
    """Parses numbers of arms from `FIRST:LAST` (both included) or `1,2,5`. Raises SpecError."""
    refusal = f"seeds {shown(text)}: write FIRST:LAST or numbers with commas, from 0 to {LARGEST_NUMBER}"
    try:
        first, *others = (int(part) for part in text.split(":" if ":" in text else ","))
    except ValueError:
        raise SpecError(refusal) from None
    named = (first, *others)
    if min(named) < 0 or max(named) > LARGEST_NUMBER:
        raise SpecError(refusal)
    if ":" not in text:
        return list(named)
    if len(named) != 2 or first > named[1]:
        raise SpecError(refusal)
    if (count := named[1] - first + 1) > MOST_NUMBERS:
        raise SpecError(f"seeds {shown(text)}: {count} arms; at most {MOST_NUMBERS} are allowed at once")
    return list(range(first, named[1] + 1))


def parse_choice(text: str, allowed: Iterable[str], what: str) -> tuple[str, ...]:
    """Parses words separated by commas, each one of `allowed`. Raises SpecError."""
    words = tuple(word.strip() for word in text.split(","))
    for word in words:
        if word not in allowed:
            raise SpecError(f"{what} {word!r}: allowed are {', '.join(allowed)}")
    return words


def compose(number: int, kind: str, load: str) -> int:
    """Returns the mock's seed for an arm."""
    return 100 * number + 10 * KINDS[kind] + LOADS[load]


def arms(numbers: Sequence[int], kinds: Sequence[str], loads: Sequence[str] = LOAD_CYCLE) -> list[int]:
    """Returns seeds of all kinds for each number; the loads take turns by number."""
    return [compose(number, kind, loads[number % len(loads)]) for number in numbers for kind in kinds]


def sample_arms(seeds: Sequence[int], count: int) -> list[int]:
    """Returns at most `count` of the seeds, kinds and loads mixed: those whose SHA-256 comes first.

    A larger sample contains the smaller ones.
    """
    return sorted(dict.fromkeys(seeds), key=lambda seed: sha256(str(seed).encode()).digest())[:count]


def drawn_arms(commit: str, cases: dict[str, int], loads: Sequence[str] = LOAD_CYCLE) -> list[int]:
    """Returns seeds drawn from the hash of a commit: the n-th of a kind from SHA-256 of `commit kind n`, its load in
    turn."""
    found = []
    for kind, count in cases.items():
        for index in range(count):
            digest = sha256(f"{commit} {kind} {index}".encode()).hexdigest()
            number = _FIRST_DRAWN + int(digest[:12], 16)
            found.append(compose(number, kind, loads[index % len(loads)]))
    return found


class Run(FrozenRecord):
    """One table of the trial: how many arms of each kind, by which experiment, and whether more may be requested."""

    experiment: Experiment = "diagnostic"
    acquire: bool = False
    cases: dict[str, Annotated[int, Field(ge=1)]]

    @field_validator("cases")
    @classmethod
    def _known_kinds(cls, cases: dict[str, int]) -> dict[str, int]:
        for kind in cases:
            if kind not in KINDS:
                raise ValueError(f"kind {kind!r}: allowed are {', '.join(KINDS)}")
        return cases


class RegisteredCode(FrozenRecord):
    """The part of every registration that identifies its code and libraries.

    `hashes`: SHA-256 of files and folders of the source tree, by path. `versions`: of libraries; the first
    registrations have none.
    """

    version: Literal[1]
    title: str
    hashes: dict[str, str]
    versions: dict[str, str] = {}

    def check_code(self, hashes: dict[str, str], versions: dict[str, str], origin: str) -> None:
        """Raises SpecError if part of the present code is not registered, or differs from the registration.

        Args:
            hashes, versions: of all that determines the outcome, at present. origin: the file, for the message.
        """
        found, registered = {**hashes, **versions}, {**self.hashes, **self.versions}
        missing = [name for name in found if name not in registered]
        if missing:
            more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
            raise SpecError(
                f"registration {origin}: lacks {', '.join(missing[:3])}{more}, which determine the outcome; "
                "`daq blind --folder trial --hashes` prints all that it must contain"
            )
        changed = [name for name, value in registered.items() if found.get(name) != value]
        if changed:
            raise SpecError(
                f"{', '.join(changed)}: not as registered; a trial of other code needs a registration of its own"
            )


class Registration(RegisteredCode):
    """A registration file of arms of the mock."""

    detectable: float
    loads: tuple[str, ...] = LOAD_CYCLE
    runs: dict[str, Run]

    @field_validator("detectable")
    @classmethod
    def _as_scored(cls, value: float) -> float:
        if value != DETECTABLE:
            raise ValueError(f"{value}: the scoring uses d′ ≥ {DETECTABLE:g} as detectable")
        return value

    @field_validator("loads")
    @classmethod
    def _known_loads(cls, loads: tuple[str, ...]) -> tuple[str, ...]:
        for load in loads:
            if load not in LOADS:
                raise ValueError(f"{load!r}: allowed are {', '.join(LOADS)}")
        return loads

    def run(self, name: str) -> Run:
        """Returns the run of that name. Raises SpecError."""
        if name not in self.runs:
            raise SpecError(f"run {name!r}: the registration has {', '.join(self.runs)}")
        return self.runs[name]

    def arms(self, name: str, commit: str) -> list[int]:
        """Returns seeds of a run, drawn from the commit that registered it."""
        return drawn_arms(commit, self.run(name).cases, self.loads)


def parse_registration(text: str, origin: str) -> Registration:
    """Parses a registration from TOML. Raises SpecError with one line."""
    try:
        return Registration.model_validate(parse_toml(text, origin))
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"{origin}: {first.where()}: {first.message}") from error
