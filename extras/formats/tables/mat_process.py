"""Reads MATLAB's .mat in a process of its own: a damaged file makes scipy's reader crash, and all of its process."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import numpy as np

from daq.contracts.errors import TraceError
from daq.traces.mapping.expression import Columns

REFUSED = 2
"""Exit code of a process that answers with an error."""
NEW = "-v7.3"


def read_mat(path: Path) -> Columns:
    """The columns of a file of MATLAB. Raises TraceError."""
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
    """Writes the columns of the file that the first argument names, or one line of error."""
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
