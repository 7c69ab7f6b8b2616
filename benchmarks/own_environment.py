"""An environment in which a program knows no robot but those of a benchmark."""

from __future__ import annotations

import os
from pathlib import Path


def environment_of(folder: Path) -> dict[str, str]:
    """This process's environment without the caller's settings, token and server; with the stop sockets of `folder`.

    Whatever runs in it belongs into `folder` as its working folder: a `daq.toml` of the caller's is then not found.
    """
    kept = {key: value for key, value in os.environ.items() if not key.upper().startswith("DAQ_")}
    return kept | {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}
