"""Reads MATLAB's .mat in a separate process, because a damaged file can crash the process of scipy's reader."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import numpy as np

from daq.contracts.errors import TraceError
from daq.traces.mapping.expression import Columns

REFUSED = 2
"""Exit code of a process that returns an error."""
NEW = "-v7.3"


def read_mat(path: Path) -> Columns:
    """Returns the columns of a MATLAB file. Raises TraceError."""
    module = [sys.executable, "-P", "-m", "extras.formats.tables.mat_process", str(path)]
    done = subprocess.run(module, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if done.returncode == REFUSED and done.stdout.decode("utf-8", "replace") == NEW:
        raise TraceError(f"{path}: is a file of MATLAB 7.3; save it again with save('{path.name}', '-v7')")
    if done.returncode:
        said = done.stdout.decode("utf-8", "replace") if done.returncode == REFUSED else "it is damaged"
        raise TraceError(f"{path}: cannot be read: {said}")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
        return {name: found[f"arr_{index}"] for index, name in enumerate(found["names"].tolist())}


def main() -> int:
    """Writes the columns of the file in the first argument, or one line of error."""
    from scipy.io import loadmat

    from extras.formats.tables.flat import columns_of

    try:
        columns = columns_of(loadmat(sys.argv[1], squeeze_me=True, struct_as_record=False))
    except NotImplementedError:
        sys.stdout.write(NEW)
        return REFUSED
    except Exception as error:  # noqa: BLE001  # a damaged file makes it raise anything
        sys.stdout.write(" ".join(str(error).split())[:200])
        return REFUSED
    np.savez(sys.stdout.buffer, *columns.values(), names=np.array([*columns], dtype=str))
    return 0


if __name__ == "__main__":
    sys.exit(main())
