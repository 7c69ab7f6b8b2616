"""Reads and writes models as JSON files, with a version that is checked before anything else."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from daq.contracts.documents import parse_json, read_text, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.refused import refused_words
from model.machine_model.model import MODEL_FORMAT, Model

LARGEST_KEPT = 1 << 20
"""Largest size (bytes) of a stored model. The service reads it whenever a client opens it; the MA2000's has 30 kB."""


class ModelFile(FrozenRecord):
    """Stored data of a model: its ID, its file's text, and its parent model and traces."""

    identity: Annotated[str, Field(pattern=r"^[0-9a-f]{12}$")]
    text: str
    parent: str | None
    traces: tuple[str, ...]


def file_of(model: Model) -> ModelFile:
    """Returns the file of a model."""
    lineage = model.lineage
    return ModelFile(identity=model.identity, text=_text(model), parent=lineage.parent, traces=lineage.traces)


def save_model(model: Model, path: Path | str) -> Path:
    """Writes a model. Returns `path`. Raises SpecError if the file cannot be written."""
    path = Path(path)
    try:
        path.write_text(_text(model), "utf-8")
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror}") from error
    return path


def load_model(path: Path | str) -> Model:
    """Loads the model in a file: a model of its own, or that of a saved fit.

    Raises SpecError, in one line, for a missing file, another kind of file, or a model of a newer version.
    """
    return model_of(parse_json(read_text(Path(path), f"model {path}"), f"model {path}"), str(path))


def model_of(data: Any, called: str) -> Model:
    """Returns the model in a file's data, likewise. called: name of the file in messages."""
    if isinstance(data, dict) and isinstance(data.get("model"), dict):
        data = data["model"]
    if not isinstance(data, dict) or "machine" not in data:
        raise SpecError(f"model {called}: is neither a model nor the result of a fit")
    _check_version(called, data.get("format"))
    try:
        return Model.model_validate(data)
    except ValidationError as error:
        raise SpecError(f"model {called}: {refused_words(error, Model, 'model')}") from error


def foreign_model(path: Path, called: str) -> ModelFile:
    """Returns the model in a file of unknown origin. Raises SpecError, also for a large model, or one with user-defined
    effects, which are programs."""
    try:
        data = parse_json(read_text(path, called), called)
        _require_no_program(data)
        made = file_of(model_of(data, called))
    except SpecError as error:
        raise SpecError(str(error).removeprefix("model ").removeprefix(f"{called}: ")) from error
    if (size := len(made.text.encode())) > LARGEST_KEPT:
        raise SpecError(f"its model has {size >> 10} kB; allowed are {LARGEST_KEPT >> 10} kB")
    return made


def _require_no_program(data: Any) -> None:
    model = data.get("model", data) if isinstance(data, dict) else None
    effects = model.get("effects") if isinstance(model, dict) else None
    if isinstance(effects, list) and any(isinstance(use, dict) and use.get("file") for use in effects):
        raise SpecError("effects: some are programs of a user, which a service does not run; use the command line")


def _text(model: Model) -> str:
    return model.model_dump_json(indent=1) + "\n"


def _check_version(called: str, version: Any) -> None:
    if not isinstance(version, int) or version < 1:
        raise SpecError(f"model {called}: states no version (format {shown(version)})")
    if version > MODEL_FORMAT:
        raise SpecError(f"model {called}: has format {version}, but this program reads up to {MODEL_FORMAT}; update it")
