"""Reads an uploaded file as a model."""

from __future__ import annotations

from typing import Any

from daq.contracts.documents import parse_json, read_text
from daq.contracts.errors import SpecError
from model.machine_model.model_file import ModelFile, file_of, model_of
from server.bounded.messages import ReadModel

LARGEST_KEPT = 1 << 20
"""Largest size of a kept model in bytes. The service reads it whenever somebody looks at it; the MA2000's has 30 kB."""


def read_model(order: ReadModel) -> ModelFile:
    """Reads the model in a file. Raises SpecError, also for one with effects that are programs of a user."""
    try:
        data = parse_json(read_text(order.path, "upload"), "upload")
        _require_no_program(data)
        made = file_of(model_of(data, "upload"))
    except SpecError as error:
        raise SpecError(str(error).removeprefix("model ").removeprefix("upload: ")) from error
    if (size := len(made.text.encode())) > LARGEST_KEPT:
        raise SpecError(f"its model has {size >> 10} kB; allowed are {LARGEST_KEPT >> 10} kB")
    return made


def _require_no_program(data: Any) -> None:
    model = data.get("model", data) if isinstance(data, dict) else None
    effects = model.get("effects") if isinstance(model, dict) else None
    if isinstance(effects, list) and any(isinstance(use, dict) and use.get("file") for use in effects):
        raise SpecError("effects: some are programs of a user, which a service does not run; use the command line")
