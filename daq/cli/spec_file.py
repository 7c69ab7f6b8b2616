"""An experiment written in a file."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, parse_spec


def read_spec(path: Path) -> ExperimentSpec:
    """The experiment of a .json or .toml file. Raises SpecError with one line."""
    try:
        text = path.read_text("utf-8")
        data = tomllib.loads(text) if path.suffix == ".toml" else json.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        raise SpecError(f"experiment {path}: cannot be read: {error}") from error
    except ValueError as error:
        raise SpecError(f"experiment {path}: not {path.suffix.removeprefix('.') or 'JSON'}: {error}") from error
    return parse_spec(data, f"experiment {path}")
