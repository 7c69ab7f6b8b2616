"""Model files: JSON with a format version; a file from a newer version is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import ValidationError

from daq.contracts.errors import SpecError
from model.machine_model.model import MODEL_FORMAT, Model


def save_model(model: Model, path: Path) -> None:
    """Write a model with its lineage. Raises SpecError when the file cannot be written."""
    try:
        path.write_text(model.model_dump_json(indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise SpecError(f"{path}: cannot be written: {error.strerror}") from error


def load_model(path: Path) -> Model:
    """Read a model. Raises SpecError for a file that is not there, not a model, or from a newer version."""
    try:
        data = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise SpecError(f"{path}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise SpecError(f"{path}: not a model file: {error}") from error
    if not isinstance(data, dict) or not isinstance(data.get("format"), int):
        raise SpecError(f"{path}: not a model file: it has no format number")
    if data["format"] > MODEL_FORMAT:
        raise SpecError(f"{path}: model format {data['format']} is newer than this program knows ({MODEL_FORMAT})")
    try:
        return Model.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "model"
        raise SpecError(f"{path}: {where}: {first['msg'].removeprefix('Value error, ')}") from error
