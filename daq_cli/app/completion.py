"""Shell completion. It runs at every press of the tab key, so nothing heavy is imported here."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path

import typer

PRESETS = ("ramp", "diagnostic", *(f"diagnostic-{letter}" for letter in "abcde"), "pseudo-random", "sweep", "held-out")
"""Names of `daq.trajectories.presets`, which would import numpy; a test keeps both equal."""
JOINTS = ("1-3", "1", "2", "3", "4", "5", "6", "1-2", "2-3", "1-6")
SUFFIXES = (".mcap", ".csv")
CONFIGURATION = "daq.toml"


def presets(incomplete: str) -> list[str]:
    """Names of presets."""
    return [name for name in PRESETS if name.startswith(incomplete)]


def joints(incomplete: str) -> list[str]:
    """Usual selections of joints."""
    return [text for text in JOINTS if text.startswith(incomplete)]


def effects(incomplete: str) -> list[str]:
    """Names of effects for the word after the last comma."""
    from daq.contracts.effects import effect_names

    before, comma, begun = incomplete.rpartition(",")
    wanted = begun.replace("-", "_")
    return [f"{before}{comma}{name}" for name in effect_names() if name.startswith(wanted)]


def traces(ctx: typer.Context, incomplete: str) -> Iterator[str]:
    """`last`, the files in the folder of traces (newest first), and the files in the folder that the word names."""
    if "last".startswith(incomplete):
        yield "last"
    folder = Path(ctx.params.get("folder") or _configured_folder())
    found = {str(path): None for path in sorted(folder.glob("*.mcap"), reverse=True)}
    here = Path(incomplete).parent if incomplete else Path()
    found |= {str(path): None for path in sorted(here.glob("*")) if path.suffix.lower() in SUFFIXES}
    yield from (name for name in found if name.startswith(incomplete))


def _configured_folder() -> str:
    """The folder of traces in ./daq.toml, read directly: loading the settings takes 0.3 s."""
    try:
        section = tomllib.loads(Path(os.environ.get("DAQ_CONFIG", CONFIGURATION)).read_text("utf-8-sig"))["traces"]
        return str(Path(section["folder"]).expanduser())
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return "traces"
