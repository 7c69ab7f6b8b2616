"""The side of pyPESTO and of `mujoco.sysid` in `benchmarks/profile_likelihoods.py`: one hanging rod, one record.

python profile_side.py TASK.json, in an environment with `pypesto` and `mujoco[sysid]`. Both are given the residuals of
MuJoCo's simulation of a rod that is described here anew. Prints JSON: estimates with 95 % intervals, pyPESTO's from
profile likelihoods, those of `mujoco.sysid` from the Jacobian at the optimum.
"""

from __future__ import annotations

import json
import logging
import sys
from pathlib import Path
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
import pypesto
import pypesto.optimize
import pypesto.profile
from mujoco import sysid

ROD = """
<mujoco>
  <option timestep="{step}" integrator="RK4" gravity="9.81 0 0"/>
  <worldbody>
    <body name="rod">
      <joint name="axis" type="hinge" axis="0 0 1" damping="{damping}" armature="{rotor}"/>
      <inertial pos="{middle} 0 0" mass="{mass}" diaginertia="{thin} {across} {across}"/>
    </body>
  </worldbody>
  <actuator><motor name="torque" joint="axis"/></actuator>
  <sensor><jointpos name="angle" joint="axis"/></sensor>
</mujoco>
"""
QUANTILE = 1.959964
CONFIDENCE = 0.95


class Rod:
    """The simulated rod for values (mass, damping, rotor), and what the record says."""

    def __init__(self, task: dict[str, Any]) -> None:
        self.length, self.period, self.substeps = task["length"], task["period"], task["substeps"]
        self.torque, self.angle = np.array(task["torque"]), np.array(task["angle"])
        self.sigma = task["sigma"]

    def spec(self, values: Any) -> Any:
        """MuJoCo's description of the rod."""
        mass, damping, rotor = (float(v) for v in values)
        across = mass * self.length**2 / 12
        text = ROD.format(
            step=self.period / self.substeps,
            damping=max(damping, 0.0),
            rotor=max(rotor, 0.0),
            middle=self.length / 2,
            mass=mass,
            thin=1e-9 * across,
            across=across,
        )
        return mujoco.MjSpec.from_string(text)

    def angles(self, model: Any) -> Any:
        """Simulated angles at the record's samples, each torque held until the next."""
        data = mujoco.MjData(model)
        data.qpos[0] = self.angle[0]
        controls = np.repeat(self.torque[:-1], self.substeps)[None, :, None]
        state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        states, _ = mujoco.rollout.rollout(model, data, state[None], controls)
        return np.concatenate(([self.angle[0]], states[0, self.substeps - 1 :: self.substeps, 1]))

    def residual(self, values: Any) -> Any:
        """(simulated − measured) / σ."""
        return (self.angles(self.spec(values).compile()) - self.angle) / self.sigma


def by_pypesto(rod: Rod, task: dict[str, Any]) -> dict[str, Any]:
    """Fits and profiles with pyPESTO: its optimizer, its starts and its profiler. Its parameters are shares of the
    starting values, for its searches take all of them to be of one size."""
    sizes = np.array(task["start"])

    def residual(shares: Any) -> Any:
        return rod.residual(np.asarray(shares) * sizes)

    def slopes(shares: Any) -> Any:
        columns = [(residual(shares + step) - residual(shares - step)) / 2e-5 for step in 1e-5 * np.eye(len(sizes))]
        return np.stack(columns, axis=1)

    objective = pypesto.Objective(
        fun=lambda shares: 0.5 * float(np.sum(residual(shares) ** 2)),
        grad=lambda shares: slopes(shares).T @ residual(shares),
        res=residual,
        sres=slopes,
    )
    low, high = np.array(task["low"]) / sizes, np.array(task["high"]) / sizes
    problem = pypesto.Problem(objective, low, high, x_guesses=[np.ones(len(sizes))], x_names=task["names"])
    optimizer = pypesto.optimize.ScipyOptimizer(method="ls_trf", tol=1e-11)
    found = pypesto.optimize.minimize(problem, optimizer, n_starts=task["starts"], progress_bar=False)
    steps = np.array(task["steps"]) / sizes
    answer = {}
    for index, name in enumerate(task["names"]):
        size = float(steps[index])
        options = pypesto.profile.ProfileOptions(
            default_step_size_absolute=size,
            default_step_size_relative=0.0,
            min_step_size_absolute=0.2 * size,
            min_step_size_relative=0.0,
            max_step_size_absolute=2 * size,
            max_step_size_relative=0.0,
        )
        profiled = pypesto.profile.parameter_profile(
            problem, found, optimizer, profile_index=[index], profile_options=options, progress_bar=False
        )
        one = profiled.profile_result.list[-1][index]
        threshold = pypesto.profile.chi2_quantile_to_ratio(CONFIDENCE)
        low, high = pypesto.profile.calculate_approximate_ci(one.x_path[index], one.ratio_path, threshold)
        best = float(found.optimize_result.x[0][index] * sizes[index])
        bounded = [one.ratio_path[0] < threshold, one.ratio_path[-1] < threshold]
        answer[name] = [
            best,
            *(float(v * sizes[index]) if is_end else None for v, is_end in zip((low, high), bounded, strict=True)),
        ]
    return answer


def by_sysid(rod: Rod, task: dict[str, Any]) -> dict[str, Any]:
    """Fits with `mujoco.sysid`: its parameters, its optimizer, and its intervals."""
    parameters = sysid.ParameterDict()
    bounds = zip(task["names"], task["start"], task["low"], task["high"], strict=True)
    for name, start, low, high in bounds:
        parameters.add(sysid.Parameter(name, start, low, high))

    def residual(values: Any, _parameters: Any) -> Any:
        columns = np.atleast_2d(np.asarray(values).T)
        found = np.stack([rod.residual(column) for column in columns], axis=1)
        return [found if np.ndim(values) > 1 else found[:, 0]], None, None

    _, result = sysid.optimize(parameters, residual, optimizer="scipy", verbose=False)
    left = rod.residual(result.x)
    _, halves = sysid.calculate_intervals([left], np.asarray(result.jac))
    return {
        name: [float(value), float(value - half), float(value + half)]
        for name, value, half in zip(task["names"], result.x, np.ravel(halves), strict=True)
    }


def main(file: str) -> None:
    """Answers one task."""
    logging.disable(logging.WARNING)
    task = json.loads(Path(file).read_text("utf-8"))
    rod = Rod(task)
    print(json.dumps({"pyPESTO": by_pypesto(rod, task), "mujoco.sysid": by_sysid(rod, task)}))


if __name__ == "__main__":
    main(*sys.argv[1:])
