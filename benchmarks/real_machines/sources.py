"""The records: where they come from, and how they become CSV files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Columns = Mapping[str, Floats]
HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"


@dataclass(frozen=True)
class Rig:
    """A machine with published records.

    origin: repository, commit, licence. folder: where its files lie below the data folder. fitted, held_out: names of
    records. read: columns of each by name. effects: those that `daq fit` adds, and `expected`, those of which
    a diagnosis should name one. constant: whether the reference has a constant torque, as friction by direction has.
    springs: joints on which the reference has a spring, at a rest that it finds.
    """

    name: str
    origin: str
    folder: str
    machine: Path
    fitted: tuple[str, ...]
    held_out: tuple[str, ...]
    read: Callable[[Path, str], Columns]
    drive_unit: str
    effects: str
    expected: tuple[tuple[str, ...], ...]
    constant: bool = False
    springs: tuple[int, ...] = ()


def _emps(folder: Path, name: str) -> Columns:
    from scipy.io import loadmat

    data = loadmat(folder / f"{name}.mat")
    return {"time": data["t"].ravel(), "position_1": data["qm"].ravel(), "drive_1": data["vir"].ravel()}


def _dc_motor(folder: Path, name: str) -> Columns:
    """One direction each: the staircase upwards ends at 52 s, and the one downwards begins there."""
    with (folder / "run_minimal.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    time, volts, rpm = (np.array([float(row[key]) for row in rows]) for key in ("time", "voltage", "rpm"))
    kept = {"whole": time >= 0.0, "up": time < 52.0, "down": time >= 52.0}[name]
    return {"time": time[kept], "drive_1": volts[kept], "velocity_1": rpm[kept] * np.pi / 30}


def _kuka(folder: Path, name: str) -> Columns:
    from scipy.io import loadmat

    path = folder / f"2020-10-21 10s FF {name} 08ms" / "data.mat"
    record = loadmat(path, squeeze_me=True, struct_as_record=False)["rec"]
    angles, torques = np.radians(record.act_pos_mot_deg), record.act_torque_abs_nm
    columns = {f"position_{j + 1}": angles[j] for j in range(6)} | {f"drive_{j + 1}": torques[j] for j in range(6)}
    return {"time": np.asarray(record.time_cont, dtype=np.float64), **columns}


def _table(folder: Path, name: str) -> Columns:
    with (folder / f"{name}.csv").open(encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        values = np.loadtxt(file, delimiter=",")
    return {key: values[:, k] for k, key in enumerate(names)}


RIGS = (
    Rig(
        "emps",
        "github.com/forgi86/sysid-neural-continuous at 956aa7ec, examples/EMPS/data (Apache-2.0; Janot, Gautier and "
        "Brunot 2019)",
        "emps",
        HERE / "emps.toml",
        ("DATA_EMPS",),
        ("DATA_EMPS_PULSES",),
        _emps,
        "V",
        "coulomb,direction_dependent_friction",
        (("coulomb_friction",), ("direction_dependent_friction", "direction_dependent_viscous_friction")),
        constant=True,
    ),
    Rig(
        "dc_motor",
        "github.com/Piyushiitk24/dc-motor-signed-bias-deadzone-id-control at 1988dae3, run_minimal.csv (no licence "
        "is stated)",
        "dc",
        HERE / "dc_motor.toml",
        ("up",),
        ("down",),
        _dc_motor,
        "V",
        "coulomb",
        (("dead_zone", "coulomb_friction"),),
    ),
    Rig(
        "double_pendulum",
        "github.com/dfki-ric-underactuated-lab/double_pendulum at 1e8544e6, design_C.1/sys_id/20230629 (BSD-3-Clause)",
        "double_pendulum",
        EXAMPLES / "double_pendulum.toml",
        tuple(f"run_{k:02d}" for k in range(1, 5)),
        tuple(f"run_{k:02d}" for k in range(5, 11)),
        _table,
        "N·m",
        "viscous,coulomb",
        (("coulomb_friction", "viscous_friction"),),
    ),
    Rig(
        "kuka",
        "github.com/JonasWeigand/Robot_Identification at 9e403c07, data/recorded_trajectories (MIT)",
        "kuka",
        HERE / "kuka.toml",
        ("A",),
        ("B", "C"),
        _kuka,
        "N·m",
        "coulomb,spring_torque:2",
        (("coulomb_friction", "viscous_friction", "gear_loss"), ("spring_torque on 2",)),
        springs=(2,),
    ),
)
"""Every rig. Two others never took part in any change of the method: see docs/benchmarks.md."""


def write_csv(rig: Rig, data: Path, name: str, out: Path, factor: float = 1.0) -> Path:
    """A record as a CSV file with its TOML. factor: on the drive, as in a unit that many times smaller."""
    columns = rig.read(data / rig.folder, name)
    path = out / f"{name}.csv"
    out.mkdir(parents=True, exist_ok=True)
    table = np.stack([v * factor if k.startswith("drive_") else v for k, v in columns.items()], axis=1)
    np.savetxt(path, table, delimiter=",", comments="", fmt="%.12g", header=",".join(columns))
    path.with_suffix(".toml").write_text(f'drive_unit = "{rig.drive_unit}"\n', encoding="utf-8")
    return path
