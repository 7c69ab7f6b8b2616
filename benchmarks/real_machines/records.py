"""Reads records of public repositories by the product's own import."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from math import isinf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomlkit
from numpy.typing import NDArray

from benchmarks.real_machines.rigs import Record, Rig, Torque
from daq.contracts.machine import load_machine
from ma2000 import read_trace

Floats = NDArray[np.float64]
Columns = dict[str, Floats]


class MissingDataError(Exception):
    """A repository or a file of it is missing; the message says where."""


def find_repository(folder: Path, name: str) -> Path:
    """Returns the folder of a repository `owner/name` below the folder of all: a checkout, a bare one, or plain files.

    Raises MissingDataError.
    """
    owner, short = name.split("/")
    for place in (f"{owner}+{short}/repo", f"{owner}+{short}", f"{owner}/{short}", f"{short}.git", short):
        if (folder / place).is_dir():
            return folder / place
    raise MissingDataError(f"{folder}: has no folder {short}, {short}.git or {owner}/{short}: get github.com/{name}")


def content(repository: Path, commit: str, path: str) -> bytes:
    """Returns a file at a commit; in a folder without git, the present file. Raises MissingDataError."""
    if not ((repository / ".git").exists() or (repository / "HEAD").is_file()):
        if not (repository / path).is_file():
            raise MissingDataError(f"{repository}: has no file {path}")
        return (repository / path).read_bytes()
    done = subprocess.run(["git", "-C", str(repository), "show", f"{commit}:{path}"], capture_output=True, check=False)
    if done.returncode:
        raise MissingDataError(f"{repository}: {commit}:{path}: {done.stderr.decode().strip().splitlines()[-1]}")
    return done.stdout


def read_columns(rig: Rig, record: Record, folder: Path) -> Columns:
    """Returns `time` and each joint's signals as the product imports them, by the names of its CSV files, in SI
    units.
    """
    repository = find_repository(folder, rig.repository)
    mapping = {signal: text.replace("{part}", record.part) for signal, text in rig.map.items()}
    where = "..".join("" if isinf(edge) else repr(edge) for edge in (record.start, record.end))
    with TemporaryDirectory() as place:
        files = [Path(place, Path(path).name) for path in record.files]
        for file, path in zip(files, record.files, strict=True):
            file.write_bytes(content(repository, rig.commit, f"{rig.folder}/{path}".lstrip("/")))
        unit = rig.drive_unit if any(signal.startswith("drive") for signal in mapping) else None
        trace = read_trace(files[0], map=mapping, where=None if where == ".." else f"time={where}", drive_unit=unit)
    columns = {"time": trace.time}
    for signal in ("set_point", "position", "drive", "velocity"):
        given = [key for key, text in mapping.items() if text != "none"]
        if any(key.rstrip("_0123456789") == signal for key in given):  # not an integrated position
            values = getattr(trace, signal)
            columns |= {f"{signal}_{joint}": values[:, trace.column(joint)] for joint in trace.joints}
    return columns


def write_record(columns: Columns, path: Path, drive_unit: str) -> Path:
    """Writes a CSV file, every value exact, and the TOML beside it with data that columns cannot hold."""
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, delimiter=",", comments="", fmt="%.17g", header=",".join(columns))
    path.with_suffix(".toml").write_text(f'drive_unit = "{drive_unit}"\n', encoding="utf-8")
    return path


def add_torque(columns: Columns, torque: Torque, gain: float) -> Columns:
    """Returns the record of a joint with an additional torque against its motion, which the drive supplies, too. gain:
    N·m per unit.
    """
    key = f"position_{torque.joint}"
    time = columns["time"]
    position = columns.get(key)
    if position is None:
        position = np.cumsum(columns[f"velocity_{torque.joint}"] * np.gradient(time))
    if torque.kind == "spring":
        added = position
    elif torque.kind == "ripple":
        added = np.sin(torque.cycles * position)
    else:
        added = np.sin(2 * np.pi * torque.frequency * (time - time[0]))
    drive = f"drive_{torque.joint}"
    return columns | {drive: columns[drive] + torque.size * added / gain}


def write_machine(source: Path, numbers: Mapping[str, float], removed: Sequence[str], path: Path) -> Path:
    """Writes a machine file with some values changed, by path such as `joints.0.link.mass.value`, or whole keys
    removed.
    """
    document = machine_data(source)
    for name in removed:
        del document[name]
    for name, value in numbers.items():
        *way, last = name.split(".")
        place: Any = document
        for part in way:
            place = place[int(part) if part.isdigit() else part]
        place[last] = value
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    return path


def machine_data(source: Path) -> dict[str, Any]:
    """Returns a machine file in full, as plain data."""
    return load_machine(str(source)).model_dump(mode="json", exclude_none=True)
