"""FIGAROH's side of `benchmarks/base_parameters.py`: its own regressor and its QR with column pivoting, for one arm.

python figaroh_side.py TASK.npz ANSWER.npz, in an environment with `figaroh`. The task has the URDF's path, the joints,
where others are held, and a motion; the answer has the base regressor, and is printed as well.
"""

from __future__ import annotations

import json
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio
from figaroh.tools.qrdecomposition import QRDecomposer
from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate

LEAST_COLUMN = 1e-6
"""Sum of squares from which FIGAROH keeps a column; its own default."""


def main(task_file: str, answer_file: str) -> None:
    """Answers one task."""
    task = np.load(task_file)
    joints, hold = json.loads(str(task["joints"])), json.loads(str(task["hold"]))
    whole: Any = pinocchio.buildModelFromUrdf(str(task["urdf"]))
    posture = pinocchio.neutral(whole)
    for name, value in hold.items():
        if whole.existJointName(name):
            posture[whole.joints[whole.getJointId(name)].idx_q] = value
    held = [whole.getJointId(name) for name in whole.names if name != "universe" and name not in joints]
    model: Any = pinocchio.buildReducedModel(whole, held, posture)
    robot = SimpleNamespace(model=model, data=model.createData())
    start = pinocchio.neutral(model)
    positions = np.array([pinocchio.integrate(model, start, q) for q in task["position"]])
    regressor = build_regressor_basic(
        robot, positions, task["speed"], task["acceleration"], {"act_idxv": range(model.nv)}
    )
    names = [f"{kind}{joint}" for joint in range(len(joints)) for kind in range(regressor.shape[1] // len(joints))]
    dropped, kept = get_index_eliminate(regressor, dict.fromkeys(names, 0.0), tol_e=LEAST_COLUMN)
    reduced = build_regressor_reduced(regressor, dropped)
    found = QRDecomposer().decompose(reduced, kept, method="pivoting")
    np.savez(answer_file, base=np.asarray(found.W_b))
    print(json.dumps({"rank": int(found.rank), "standard": regressor.shape[1]}))


if __name__ == "__main__":
    main(*sys.argv[1:])
