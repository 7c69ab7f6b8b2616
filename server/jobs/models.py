"""The models of one robot: files in a folder, listed in the database."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from daq.contracts.documents import parse_json
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from daq.contracts.service.jobs import MACHINE, EffectInModel, ModelDetails, ModelParameter
from model.effects.names import placed
from model.machine_model.model import EffectUse, Model, base_model
from model.machine_model.model_file import load_model, model_of, save_model
from model.machine_model.parameter_words import words_of
from server.clock import Clock
from server.problems import ProblemError
from server.store.models import ModelStore, NewModel

AS_FITTED = "send a file as `daq fit` writes it"
LARGEST_MODEL = 16 << 20
"""Largest size of a model's file in bytes."""


class Models:
    """Adds models and finds them. Safe to use from any thread."""

    def __init__(self, folder: Path, robot: str, machine: Machine, store: ModelStore, clock: Clock) -> None:
        self.folder = folder
        self.store = store
        self._robot = robot
        self._machine = machine
        self._clock = clock

    def take_in(self, path: Path, name: str, by: str, job: str | None) -> str:
        """Adds a model from its file, and returns its number. Adding it again changes nothing. Raises SpecError."""
        return self._keep(load_model(path), name, by, job)

    def _keep(self, model: Model, name: str, by: str, job: str | None) -> str:
        self.folder.mkdir(parents=True, exist_ok=True)
        file = f"{model.identity}.json"
        part = self.folder / f"{file}.part"
        save_model(model, part)
        with part.open("rb") as stream:
            os.fsync(stream.fileno())
        part.replace(self.folder / file)
        lineage = model.lineage
        self.store.insert(
            NewModel(
                id=model.identity,
                robot=self._robot,
                name=name[:64],
                file=file,
                created=self._clock.utc(),
                created_by=by,
                parent=lineage.parent,
                job=job,
                traces=lineage.traces,
            )
        )
        return model.identity

    def take_in_text(self, text: bytes, name: str, by: str) -> str:
        """Adds an uploaded model. Raises a 422, also if the model has effects that are programs."""
        try:
            data = parse_json(text.decode("utf-8"), "upload")
        except UnicodeDecodeError as error:
            raise ProblemError(422, "not-a-model", "the body is not text in UTF-8", AS_FITTED) from error
        except SpecError as error:
            raise ProblemError(422, "not-a-model", str(error), AS_FITTED) from error
        if _has_program(data):
            line = "this model has effects that are programs of a user: a service does not run those"
            raise ProblemError(422, "not-a-model", line, "use it with the command line")
        try:
            return self._keep(model_of(data, "upload"), name, by, None)
        except SpecError as error:
            raise ProblemError(422, "not-a-model", str(error), AS_FITTED) from error

    def path_of(self, identity: str) -> Path:
        """Returns a model's file. Raises a 404."""
        return self.folder / self.store.file_of(self._robot, identity)

    def name_of(self, identity: str) -> str:
        """Returns a model's name, for tables. Raises a 404."""
        return self._machine.name if identity == MACHINE else self.store.get(self._robot, identity).name

    def details(self, identity: str) -> ModelDetails:
        """Returns a model's effects, parameters and ancestors. Raises a 404."""
        entry = self.store.get(self._robot, identity)
        model = load_model(self.path_of(identity))
        return ModelDetails(
            entry=entry,
            effects=tuple(map(_effect, model.effects)),
            parameters=_parameters(model),
            ancestors=self.store.ancestors(self._robot, identity),
        )

    def machine_identity(self) -> str:
        """Returns the number of the model that the machine file describes."""
        return base_model(self._machine).identity

    def machine_parameters(self) -> tuple[ModelParameter, ...]:
        """Returns the parameters of the model that the machine file describes."""
        return _parameters(base_model(self._machine))

    def remove(self, identity: str) -> None:
        """Deletes a model's row and file. Raises a 404, 409."""
        file = self.store.remove(self._robot, identity)
        if file is not None:
            (self.folder / file).unlink(missing_ok=True)


def _effect(use: EffectUse) -> EffectInModel:
    return EffectInModel(name=use.name, joints=use.joints, called=placed(use.name, use.joints))


def _parameters(model: Model) -> tuple[ModelParameter, ...]:
    return tuple(
        ModelParameter(
            name=one.name,
            words=words_of(one),
            unit=one.unit,
            value=one.value,
            low=_finite(one.low),
            high=_finite(one.high),
            deviation=one.deviation,
        )
        for one in model.parameters
    )


def _finite(value: float | None) -> float | None:
    return None if value is None or abs(value) == float("inf") else value


def _has_program(data: Any) -> bool:
    """Whether any effect in the data has a program file."""
    if isinstance(data, dict):
        effects = data.get("effects")
        own = isinstance(effects, list) and any(isinstance(use, dict) and use.get("file") for use in effects)
        return own or any(_has_program(value) for value in data.values())
    return isinstance(data, list) and any(_has_program(value) for value in data)
