"""Records of public repositories as the CSV files that the product imports: columns are renamed, scaled, selected."""

from __future__ import annotations

import io
import json
import re
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from numpy.typing import NDArray

from benchmarks.real_machines.rigs import Record, Rig, Torque
from daq.contracts.machine import load_machine

Floats = NDArray[np.float64]
Columns = dict[str, Floats]


class MissingDataError(Exception):
    """A repository or a file of it is not where it was looked for; the message says where."""


def find_repository(folder: Path, name: str) -> Path:
    """The folder of a repository `owner/name` below the one that holds them: a checkout, a bare one, or plain files.

    Raises MissingDataError.
    """
    owner, short = name.split("/")
    for place in (f"{owner}+{short}/repo", f"{owner}+{short}", f"{owner}/{short}", f"{short}.git", short):
        if (folder / place).is_dir():
            return folder / place
    raise MissingDataError(f"{folder}: has no folder {short}, {short}.git or {owner}/{short}: get github.com/{name}")


def content(repository: Path, commit: str, path: str) -> bytes:
    """A file at a commit; of a folder without git, the file as it is. Raises MissingDataError."""
    if not ((repository / ".git").exists() or (repository / "HEAD").is_file()):
        if not (repository / path).is_file():
            raise MissingDataError(f"{repository}: has no file {path}")
        return (repository / path).read_bytes()
    done = subprocess.run(["git", "-C", str(repository), "show", f"{commit}:{path}"], capture_output=True, check=False)
    if done.returncode:
        raise MissingDataError(f"{repository}: {commit}:{path}: {done.stderr.decode().strip().splitlines()[-1]}")
    return done.stdout


def read_columns(rig: Rig, record: Record, folder: Path) -> Columns:
    """`time` and each joint's signals, by the names of the product's CSV files, in SI units."""
    repository = find_repository(folder, rig.repository)
    paths = [f"{rig.folder}/{path}".lstrip("/") for path in record.files]
    tables = [_parse(path, content(repository, rig.commit, path)) for path in paths]
    for part in record.part.split(".") if record.part else ():
        tables = [table[int(part) if part.isdigit() else part] for table in tables]
    columns = {"time": _sum(rig.columns["time"][0], tables)}
    for signal, items in rig.columns.items():
        if signal != "time":
            columns |= {f"{signal}_{j}": _sum(item, tables) for j, item in enumerate(items, start=1)}
    kept = (columns["time"] >= record.start) & (columns["time"] < record.end)
    for values in columns.values():  # rows without a reading
        kept &= np.isfinite(values)
    return {name: values[kept] for name, values in columns.items()}


def write_record(columns: Columns, path: Path, drive_unit: str) -> Path:
    """A CSV file, every number exact, and the TOML beside it that says what columns cannot."""
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(path, table, delimiter=",", comments="", fmt="%.17g", header=",".join(columns))
    path.with_suffix(".toml").write_text(f'drive_unit = "{drive_unit}"\n', encoding="utf-8")
    return path


def add_torque(columns: Columns, torque: Torque, gain: float) -> Columns:
    """The record of a joint with one torque more against its motion: the drive gives it, too. gain: N·m a unit."""
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
    """A machine file with some numbers of it changed, by path such as `joints.0.link.mass.value`, or whole keys out."""
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
    """A machine file in full, as plain data."""
    return load_machine(str(source)).model_dump(mode="json", exclude_none=True)


def _parse(path: str, data: bytes) -> Any:
    kind = path.rpartition(".")[2]
    if kind == "json":
        return json.loads(data)
    if kind == "npz":
        return np.load(io.BytesIO(data))
    if kind == "mat":
        from scipy.io import loadmat

        return loadmat(io.BytesIO(data), squeeze_me=True, struct_as_record=False)  # type: ignore[arg-type]
    if kind == "parquet":
        import pyarrow.parquet

        return pyarrow.parquet.read_table(io.BytesIO(data)).to_pydict()
    lines = [line for line in data.decode("utf-8-sig").splitlines() if not line.lstrip('"').startswith("#")]
    comma = max(",;\t", key=lines[0].count)
    head = lines[0].split(comma)
    if re.fullmatch(r"[-+]?[.\d][-+.e\d]*", head[0]):  # no line of names: columns have their numbers
        head, lines = [str(index) for index in range(len(head))], ["", *lines]
    table = np.genfromtxt(lines[1:], delimiter=comma, ndmin=2)
    return {name: table[:, index] for index, name in enumerate(head)}


def _sum(item: str | list[Any], tables: Sequence[Any]) -> Floats:
    """A column, or the sum of [factor, key] and [offset]."""
    if isinstance(item, str):
        return _column(item, tables)
    total: Any = 0.0
    for factor, *rest in item:
        column: Any = _column(rest[0], tables) if rest else 1.0
        if rest[1:] == ["int16"]:
            column = np.where(column >= 2**15, column - 2**16, column)
        total = total + factor * column
    return np.asarray(total, dtype=np.float64)


def _column(key: str, tables: Sequence[Any]) -> Floats:
    number, colon, name = key.partition(":")
    found = tables[int(number)] if colon and number.isdigit() else tables[0]
    name = name if colon and number.isdigit() else key
    if name == "#":
        rows = max(len(each) for each in found.values() if not isinstance(each, str))
        return np.arange(rows, dtype=np.float64)
    if isinstance(found, Mapping) and name in found:
        return np.asarray(found[name], dtype=np.float64).ravel()
    way = re.fullmatch(r"(.*?)(?:\[(\d+)(?:::(\d+))?\])?", name)
    assert way is not None
    for part in [way[1]] if isinstance(found, Mapping) and way[1] in found else way[1].split("."):
        if isinstance(found, list):
            found = [entry[part] for entry in found]
        else:
            found = getattr(found, part) if hasattr(found, part) else found[part]
    values = np.asarray(found, dtype=np.float64)
    if way[2] is None:
        return values.ravel()
    if way[3] is not None:
        return values[int(way[2]) :: int(way[3])]
    return values[:, int(way[2])] if values.shape[0] > values.shape[1] else values[int(way[2])]
