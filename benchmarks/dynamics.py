"""Time of one evaluation of the arm's dynamics: ours beside C, MuJoCo and Pinocchio.

    python -m benchmarks.dynamics

Each evaluation gives D, H + G and the accelerations of the three-joint arm (table 7.9). "In a row": as in a
simulation, every state depends on the accelerations before it. "Side by side": many independent states, as in
a batch of runs, where a loop without calls is vectorised. Needs gcc.
"""

from __future__ import annotations

import argparse
import ctypes
import functools
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numba
import numpy as np
import pinocchio

from model.dynamics import recursive, three_joint_motion
from model.dynamics.effective_inertia import effective_parameters
from model.kinematics.chain import Chain, Link
from tests.model.dynamics.chains import TABLE_7_9
from tests.model.dynamics.oracles import MuJoCo, Pinocchio

REPEATS = 7
STATES = 256
"""Number of independent states evaluated side by side."""
C_NAME = "C -O3 -march=native, same expressions"
_DOUBLES = ctypes.POINTER(ctypes.c_double)
START = np.array([0.2, 0.7, -0.4, 0.5, -0.3, 0.8])
"""Joint angles and rates at which the loop starts, rad and rad/s."""
FEEDBACK = 1e-9
"""Share of each acceleration that enters the next state: enough for a dependence, too little to move the arm."""

_C = r"""
#include "three_joint.h"
static inline void solve(const double *m, const double *t, double *restrict a) {
  const double r = 1.0/m[0], l2 = m[1]*r, l3 = m[2]*r;
  const double e22 = m[3]-l2*m[1], e23 = m[4]-l2*m[2], e33 = m[5]-l3*m[2];
  const double b1 = t[0]-m[6], b2 = t[1]-m[7]-l2*b1, b3 = t[2]-m[8]-l3*b1, d = 1.0/(e22*e33-e23*e23);
  a[1] = (e33*b2-e23*b3)*d; a[2] = (e22*b3-e23*b2)*d; a[0] = (b1-m[1]*a[1]-m[2]*a[2])*r;
}
double run(long n, const double *s, const double *p, double k) {
  double x2 = s[1], x3 = s[2], v1 = s[3], v2 = s[4], v3 = s[5], m[9], a[3], t[3] = {1.0, 2.0, 0.5};
  for (long i = 0; i < n; i++) {
    mass_matrix_and_bias(x2, x3, v1, v2, v3, p, m);
    solve(m, t, a);
    x2 += k*a[1]; x3 += k*a[2]; v1 += k*a[0];
  }
  return x2 + x3 + v1;
}
void run_many(long n, long states, const double *restrict s, const double *p, double *restrict out) {
  double m[9];
  const double t[3] = {1.0, 2.0, 0.5};
  for (long k = 0; k < n; k++)
    for (long i = 0; i < states; i++) {
      double a[3];
      mass_matrix_and_bias(s[i], s[states+i], s[2*states+i], s[3*states+i], s[4*states+i], p, m);
      solve(m, t, a);
      out[i] = a[0]; out[states+i] = a[1]; out[2*states+i] = a[2];
    }
}
"""


@numba.njit(error_model="numpy", fastmath={"contract"})
def _closed_form(n: int, s: Any, p: Any, k: float) -> Any:
    x2, x3, v1, v2, v3 = s[1], s[2], s[3], s[4], s[5]
    for _ in range(n):
        a1, a2, a3 = three_joint_motion.accelerations(x2, x3, v1, v2, v3, 1.0, 2.0, 0.5, p)
        x2 += k * a2
        x3 += k * a3
        v1 += k * a1
    return x2 + x3 + v1


@numba.njit(error_model="numpy", fastmath={"contract"})
def _closed_form_many(n: int, s: Any, p: Any, out: Any) -> None:
    for _ in range(n):
        for i in range(s.shape[1]):
            a1, a2, a3 = three_joint_motion.accelerations(s[0, i], s[1, i], s[2, i], s[3, i], s[4, i], 1.0, 2.0, 0.5, p)
            out[0, i], out[1, i], out[2, i] = a1, a2, a3


@numba.njit(error_model="numpy", fastmath={"contract"})
def _recursive(n: int, s: Any, chain: Any, k: float) -> Any:
    q, velocity, torque = s[:3].copy(), s[3:].copy(), np.array([1.0, 2.0, 0.5])
    for _ in range(n):
        q += k * recursive.forward_dynamics(chain, q, velocity, torque)
    return q[0]


def main() -> int:
    """Print the table; nothing is asserted, times belong to the machine."""
    argparse.ArgumentParser(prog="python -m benchmarks.dynamics", description=__doc__).parse_args()
    chain = TABLE_7_9.chain()
    rows = [*_in_a_row(chain), *_other_engines(chain), *_side_by_side(chain)]
    reference = dict(rows)[C_NAME]
    for name, nanoseconds in rows:
        sys.stdout.write(f"{name:58s} {nanoseconds:10.1f} ns   {nanoseconds / reference:8.2f} × C\n")
    return 0


def _in_a_row(chain: Chain) -> list[tuple[str, float]]:
    p, arrays = effective_parameters(chain), chain.arrays()
    c_run = _compile_c().run
    c_run.argtypes, c_run.restype = [ctypes.c_long, _DOUBLES, _DOUBLES, ctypes.c_double], ctypes.c_double
    start, parameters = _pointer(START), _pointer(p)
    _assert_same(_closed_form(1000, START, p, 1e-3), c_run(1000, start, parameters, 1e-3))
    s, pc = START.astype(complex), p.astype(complex)
    return [
        ("numba closed form", _time(lambda n: _closed_form(n, START, p, FEEDBACK), 1_000_000)),
        (C_NAME, _time(lambda n: c_run(n, start, parameters, FEEDBACK), 1_000_000)),
        ("numba closed form, dual numbers", _time(lambda n: _closed_form(n, s, pc, FEEDBACK), 1_000_000)),
        ("numba recursive, any chain", _time(lambda n: _recursive(n, START, arrays, FEEDBACK), 100_000)),
    ]


def _side_by_side(chain: Chain) -> list[tuple[str, float]]:
    p = effective_parameters(chain)
    states = np.random.default_rng(1).normal(size=(5, STATES))
    ours, theirs = np.empty((3, STATES)), np.empty((3, STATES))
    c_run = _compile_c().run_many
    c_run.argtypes, c_run.restype = [ctypes.c_long, ctypes.c_long, _DOUBLES, _DOUBLES, _DOUBLES], None
    arguments = STATES, _pointer(states), _pointer(p), _pointer(theirs)
    _closed_form_many(1, states, p, ours)
    c_run(1, *arguments)
    _assert_same(float(ours.sum()), float(theirs.sum()))
    return [
        ("numba closed form, side by side", _time(lambda n: _closed_form_many(n, states, p, ours), 1000) / STATES),
        ("C, side by side", _time(lambda n: c_run(n, *arguments), 1000) / STATES),
    ]


def _pointer(values: Any) -> Any:
    return values.ctypes.data_as(_DOUBLES)


def _time(run: Callable[[int], Any], n: int) -> float:
    """Best of several repetitions, ns per evaluation."""
    run(10)
    best = float("inf")
    for _ in range(REPEATS):
        start = time.perf_counter()
        run(n)
        best = min(best, time.perf_counter() - start)
    return best / n * 1e9


@functools.cache
def _compile_c() -> Any:
    folder = Path(tempfile.mkdtemp(prefix="ma2000-benchmark-"))
    source, library = folder / "run.c", folder / "run.so"
    source.write_text(_C, encoding="utf-8")
    here = str(Path(__file__).parent)
    command = ["gcc", "-O3", "-march=native", "-shared", "-fPIC", "-I", here, str(source), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


def _other_engines(chain: Chain) -> list[tuple[str, float]]:
    model = Pinocchio(chain)
    q, velocity, torque = START[:3].copy(), START[3:].copy(), np.array([1.0, 2.0, 0.5])

    def pinocchio_run(n: int) -> None:
        for _ in range(n):
            pinocchio.aba(model.model, model.data, q, velocity, torque)

    engine = MuJoCo(_with_inertia(chain))
    engine.model.opt.timestep = FEEDBACK
    engine.model.opt.enableflags = 0
    engine.data.qpos[:], engine.data.qvel[:], engine.data.qfrc_applied[:] = q, velocity, torque

    def mujoco_terms(n: int) -> None:
        for _ in range(n):
            mujoco.mj_fwdPosition(engine.model, engine.data)
            mujoco.mj_fwdVelocity(engine.model, engine.data)
            mujoco.mj_fwdAcceleration(engine.model, engine.data)

    return [
        (
            "MuJoCo, one Euler step in its own C loop (mj_step)",
            _time(lambda n: mujoco.mj_step(engine.model, engine.data, nstep=n), 100_000),
        ),
        ("MuJoCo, position, velocity, acceleration from Python", _time(mujoco_terms, 20_000)),
        ("Pinocchio, articulated bodies (aba) from Python", _time(pinocchio_run, 20_000)),
    ]


def _with_inertia(chain: Chain) -> Chain:
    """MuJoCo refuses bodies without inertia about some axis: give each a little."""
    links = tuple(Link(m.mass, m.centre_of_mass, m.inertia + 1e-6 * np.eye(3)) for m in chain.links)
    return replace(chain, links=links)


def _assert_same(ours: float, theirs: float) -> None:
    if abs(ours - theirs) > 1e-9 * abs(theirs):
        raise AssertionError(f"the C and numba versions disagree: {ours} and {theirs}")


if __name__ == "__main__":
    sys.exit(main())
