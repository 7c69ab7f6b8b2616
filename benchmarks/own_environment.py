"""Makes an environment in which a program finds only the robots of a benchmark."""

from __future__ import annotations

import os
from pathlib import Path


def environment_of(folder: Path) -> dict[str, str]:
    """Returns this process's environment without the caller's settings, token and server; with the stop sockets of
    `folder`.

    Run programs in it with `folder` as the working folder, so that they do not find a `daq.toml` of the caller.
    """
    kept = {key: value for key, value in os.environ.items() if not key.upper().startswith("DAQ_")}
    return kept | {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}
