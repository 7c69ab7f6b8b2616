"""Base parameters of published arms beside those of Pinocchio's regressor and of FIGAROH: rank and span.

python -m benchmarks base_parameters [--figaroh PYTHON]

PYTHON is that of an environment made by `python -m venv figaroh-env; figaroh-env/bin/pip install figaroh`. The angle is
the sine of the largest angle between the spaces that the two regressors' columns span along 200 random samples.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pinocchio
from scipy.linalg import qr

from model.arrays import Floats
from model.base_parameters.base_parameters import base_parameters, random_motion
from model.base_parameters.grouping import DEPENDENT
from model.base_parameters.standard import Motion, inertial_regressor
from model.machine_model.model import base_model
from model.robot_files.machine_of_arm import machine_from_urdf
from model.simulation.chain_of_model import chain_of
from tests.model.robot_files.arms import ARMS, InPinocchio, PublishedArm

SAMPLES = 200
AGREEMENT = 1e-9
PEER = Path(__file__).parent / "peers" / "figaroh_side.py"


def main(arguments: list[str]) -> int:
    """Prints a row for each arm; 1 where a rank or a span differs."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks base_parameters", description=__doc__)
    parser.add_argument("--figaroh", help="the Python of an environment with figaroh")
    given = parser.parse_args(arguments)
    print(f"{'arm':32} inertial  of  Pinocchio  angle    FIGAROH  angle")
    return max(_row(name, arm, given.figaroh) for name, arm in ARMS.items())


def _row(name: str, arm: PublishedArm, figaroh: str | None) -> int:
    model = base_model(machine_from_urdf(arm.path, arm.joints, hold=arm.hold))
    found = base_parameters(model)
    motion = random_motion(model.machine, SAMPLES, seed=3)
    ours = inertial_regressor(chain_of(model), motion)
    span = space(ours.reshape(-1, ours.shape[-1]), found.inertial)
    by_joint = space(np.swapaxes(ours, 0, 1).reshape(-1, ours.shape[-1]), found.inertial)
    theirs = pinocchio_regressor(arm, motion)
    rank = rank_of(theirs)
    angles, ranks = [angle(span, space(theirs, rank))], [rank]
    text = f"{name:32} {found.inertial:8} {ours.shape[-1]:3} {rank:10}  {angles[0]:.1e}"
    if figaroh is not None:
        rank, base = _of_figaroh(figaroh, arm, motion)
        ranks.append(rank)
        angles.append(angle(by_joint, space(base, rank)))
        text += f" {rank:8}  {angles[1]:.1e}"
    print(text, flush=True)
    return int(max(angles) > AGREEMENT or set(ranks) != {found.inertial})


def pinocchio_regressor(arm: PublishedArm, motion: Motion) -> Floats:
    """Pinocchio's regressor (rows, 10 n) of an arm along a motion, with its own reader of the URDF."""
    other = InPinocchio(arm)
    rows = [
        np.array(pinocchio.computeJointTorqueRegressor(other.model, other.data, other.posture(q), v, a))
        for q, v, a in zip(motion.position, motion.speed, motion.acceleration, strict=True)
    ]
    return np.concatenate(rows)


def space(columns: Floats, rank: int) -> Floats:
    """An orthonormal basis (rows, rank) of what columns span."""
    basis: Floats = qr(_of_one_size(columns), mode="economic", pivoting=True)[0]
    return basis[:, :rank]


def rank_of(columns: Floats) -> int:
    """Rank by singular values of columns of one size; those that are zero but for rounding are left out."""
    return int(np.linalg.matrix_rank(_of_one_size(columns), rtol=DEPENDENT))


def _of_one_size(columns: Floats) -> Floats:
    sizes = np.linalg.norm(columns, axis=0)
    shown = sizes > DEPENDENT * sizes.max()
    return columns[:, shown] / sizes[shown]


def angle(one: Floats, other: Floats) -> float:
    """Sine of the largest angle between two spaces, given by orthonormal bases."""
    return float(max(np.linalg.norm(a - b @ (b.T @ a), 2) for a, b in ((one, other), (other, one))))


def _of_figaroh(python: str, arm: PublishedArm, motion: Motion) -> tuple[int, Floats]:
    """Rank and base regressor, its rows joint after joint."""
    with tempfile.TemporaryDirectory() as folder:
        task, answer = Path(folder, "task.npz"), Path(folder, "answer.npz")
        np.savez(
            task,
            urdf=str(arm.path),
            joints=json.dumps(arm.joints),
            hold=json.dumps(arm.hold),
            position=motion.position,
            speed=motion.speed,
            acceleration=motion.acceleration,
        )
        done = subprocess.run(
            [python, str(PEER), str(task), str(answer)], check=True, stdout=subprocess.PIPE, text=True
        )
        return int(json.loads(done.stdout.splitlines()[-1])["rank"]), np.load(answer)["base"]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
