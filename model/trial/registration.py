"""Registration of a trial before it is run: cases, experiments, and hashes of the code under trial."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationError, field_validator

from daq.contracts.documents import parse_toml
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from firmware_protocol.invalid import first_invalid
from model.trial.arms import KINDS, LOAD_CYCLE, LOADS, drawn_arms
from model.trial.truth import DETECTABLE

Experiment = Literal["diagnostic", "ramp"]


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
