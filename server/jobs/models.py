"""The models of one robot: files in a folder, listed in the database. Modules that read model files are imported on
first use."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.machine import Machine
from daq.contracts.service.jobs import MACHINE, ModelDetails, ModelParameter
from daq.contracts.whole_file import replacing
from server.clock import Clock
from server.store.models import ModelStore
from server.store.tables import ModelRow

if TYPE_CHECKING:
    from model.machine_model.model import Model
    from model.machine_model.model_file import ModelFile


class Models:
    """Adds models and finds them. Safe to use from any thread."""

    def __init__(self, folder: Path, robot: str, machine: Machine, store: ModelStore, clock: Clock) -> None:
        self.folder = folder
        self.store = store
        self._robot = robot
        self._machine = machine
        self._clock = clock

    def add_from_file(self, path: Path, name: str, by: str, job: str) -> str:
        """Adds a job's model, and returns its ID. Adding it again changes nothing. Raises SpecError."""
        from model.machine_model.model_file import file_of, load_model

        new = file_of(load_model(path))
        self.add(new, name, by, job)
        return new.identity

    def add(
        self, made: ModelFile, name: str, by: str, job: str | None = None, robots: Collection[str] | None = None
    ) -> bool:
        """Adds a model; returns False if the robot has it already. An ID belongs to exactly one text, so its file is
        written once.

        `robots`: the model's traces must belong to these; None: to any. Raises a 422 otherwise, SpecError if another
        model has its ID.
        """
        new = ModelRow(
            id=made.identity,
            robot=self._robot,
            name=name[:64],
            file=f"{made.identity}.json",
            created=self._clock.utc(),
            created_by=by,
            parent=made.parent,
            job=job,
        )

        def write() -> None:
            path = self.folder / f"{made.identity}.json"
            if _is_stored(path, made):
                return
            self.folder.mkdir(parents=True, exist_ok=True)
            with replacing(path) as part:
                part.write_text(made.text, "utf-8")

        return self.store.insert(new, made.traces, write, robots)

    def path_of(self, identity: str) -> Path:
        """Returns a model's file. Raises a 404."""
        return self.folder / self.store.file_of(self._robot, identity)

    def name_of(self, identity: str) -> str:
        """Returns a model's name, for tables. Raises a 404."""
        return self._machine.name if identity == MACHINE else self.store.get(self._robot, identity).name

    def details(self, identity: str) -> ModelDetails:
        """Returns a model's effects, parameters and ancestors. Raises a 404."""
        from model.machine_model.model_file import load_model
        from model.machine_model.parameter_words import effects_of, parameters_of

        entry = self.store.get(self._robot, identity)
        model = load_model(self.path_of(identity))
        return ModelDetails(
            entry=entry,
            effects=effects_of(model),
            parameters=parameters_of(model),
            ancestors=self.store.ancestors(self._robot, identity),
        )

    def machine_identity(self) -> str:
        """Returns the ID of the model that the machine file describes."""
        return self._base().identity

    def machine_parameters(self) -> tuple[ModelParameter, ...]:
        """Returns the parameters of the model that the machine file describes."""
        from model.machine_model.parameter_words import parameters_of

        return parameters_of(self._base())

    def _base(self) -> Model:
        from model.machine_model.model import base_model

        return base_model(self._machine)

    def remove(self, identity: str) -> None:
        """Deletes a model's row and file. Raises a 404, 409."""
        self.store.remove(self._robot, identity, lambda file: (self.folder / file).unlink(missing_ok=True))


def _is_stored(path: Path, made: ModelFile) -> bool:
    """Whether the model is stored in its file. A missing, damaged or changed file must be written again. Raises
    SpecError if the file contains another model with the same ID."""
    from model.machine_model.model_file import file_of, load_model

    try:
        there = file_of(load_model(path))
    except (DaqError, OSError):
        return False
    if there.identity == made.identity and there.text != made.text:
        raise SpecError(f"model {made.identity}: another model has this ID; change any of its values")
    return there.identity == made.identity
