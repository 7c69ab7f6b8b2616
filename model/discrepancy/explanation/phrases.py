"""The phrases of an answer, from `phrases.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib import resources

_ALL = tomllib.loads(resources.files("model.discrepancy.explanation").joinpath("phrases.toml").read_text("utf-8"))
PATTERNS: Mapping[str, str] = _ALL["patterns"]
PHASES: Mapping[str, str] = _ALL["phases"]
REFUSALS: Mapping[str, str] = _ALL["refusals"]
STAGES: Mapping[str, str] = _ALL["stages"]
METHODS: Mapping[str, str] = _ALL["methods"]
NOTHING: Mapping[str, str] = _ALL["nothing"]
NOTHING_AT_LENGTH: Mapping[str, str] = _ALL["nothing_at_length"]
NOTES: Mapping[str, str] = _ALL["notes"]
