"""The source's 13 parameters fitted to four traces: ours beside `mujoco.sysid`, and beside Nelder and Mead.

    python -m benchmarks fitting            four traces of 12 s
    python -m benchmarks fitting --quick    four traces of 5 s

All three minimise the squared error of the same records, made by the mock with other values of these parameters
(its friction is neither ours nor MuJoCo's, its readings have noise and are rounded), from the same beginning and within
the same bounds. They are done within what the noise can tell from the least: a sum of squares larger by one noise
variance. Times are the processor's, of all threads. `mujoco.sysid` gets its optimiser, its finite differences, and a
simulation by MuJoCo that is as quick as Python allows: compiled once, parameters written into the compiled model, the
controller's tick in Python and everything between two changes of the drive in one call. It needs the packages of
`pip install "mujoco[sysid]"`; without them that line says so. Nelder and Mead get our engine, and stop when they reach
our error or after so many evaluations. Each is run once to warm up and then three times, in turn; its least time
counts.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from benchmarks.figures import Figure, at_least, show
from benchmarks.mock_arm import FRICTION_ARMS, board_text, plant_text, recorded
from daq.contracts.experiment import ExperimentSpec, Multisine
from daq.contracts.machine import Machine, load_machine
from daq.contracts.progress import Never
from model.arrays import Floats
from model.fitting.fit import fit_problem
from model.fitting.least_squares import Search, solve
from model.fitting.nelder_mead import climb
from model.fitting.options import FitOptions
from model.fitting.simulated import SimulatedProblem
from model.fitting.whitening import white
from model.machine_model.model import Model, base_model

PERIOD = 0.02
SUBSTEP = 1e-3
DELAY = 0.006
VOLTS_PER_COUNT = 36.0 / 127
TIED_BACK_EMF, TIED_ARM = "motor.back_emf_constant_1_3", "friction.arm"
NAMES = (
    "link1.mass",
    "link2.mass",
    "link3.mass",
    "load.mass",
    "link1.radius",
    "link2.length",
    "link3.length",
    TIED_BACK_EMF,
    "joint2.motor.back_emf_constant",
    "joint1.viscous_friction.coefficient",
    "joint2.viscous_friction.coefficient",
    "joint3.viscous_friction.coefficient",
    TIED_ARM,
)
"""Table 7.9: seven of bodies, two back-EMF constants, three of viscous friction, one arm of Coulomb friction."""
EMF = tuple(f"joint{j}.motor.back_emf_constant" for j in (1, 3))
SPREAD = 0.15
"""Relative standard deviation of the true values from those that the fits begin with."""
SIMPLEX_LIMIT = 20_000
REPEATS = 3
STARTS = ((3.1, 0.7, 0.0), (2.6, 1.7, -1.0), (3.6, 2.2, -0.6), (3.0, 1.2, 0.8))


@dataclass(frozen=True)
class Run:
    """One fit: time (s) by the processor and by the clock, mean squared error (rad²) at its end, evaluations."""

    seconds: float
    wall: float
    error: float
    evaluations: int


class Watch:
    """Time that passes, by this process's processor time and by the clock."""

    def __init__(self) -> None:
        self.began = time.process_time(), time.perf_counter()

    def passed(self) -> tuple[float, float]:
        """Elapsed seconds of both clocks."""
        return time.process_time() - self.began[0], time.perf_counter() - self.began[1]


def thirteen(machine: Machine) -> Model:
    """The model of table 7.9 with its ties."""
    return base_model(machine).tied(TIED_BACK_EMF, EMF).tied(TIED_ARM, FRICTION_ARMS)


def experiments(seconds: float) -> list[ExperimentSpec]:
    """Four multisines about four postures."""
    amplitude = {1: 0.3, 2: 0.2, 3: 0.3}
    return [
        ExperimentSpec(
            trajectory=Multisine(
                kind="multisine", amplitude=amplitude, duration=seconds, lowest=0.1, highest=0.8, tones=6, seed=number
            ),
            joints=(1, 2, 3),
            start=dict(zip((1, 2, 3), start, strict=True)),
            settle=0.5,
            hold=0.5,
        )
        for number, start in enumerate(STARTS, start=1)
    ]


def hidden(truth: dict[str, float]) -> dict[str, float]:
    """The true values by the names of the mock's plant file."""
    shared = dict.fromkeys(EMF, truth[TIED_BACK_EMF])
    return {**{n: v for n, v in truth.items() if n != TIED_BACK_EMF}, **shared}


class Arm:
    """The same arm in MuJoCo, driven tick by tick."""

    XML = """<mujoco><option timestep="0.001" gravity="0 0 -9.81" integrator="implicitfast"/>
    <worldbody><body><joint name="1" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body><joint name="2" axis="0 -1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body><joint name="3" axis="0 -1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    </body></body></body></worldbody></mujoco>"""
    THIN = 1e-9
    """Inertia (kg·m²) of a thin rod about itself, which MuJoCo requires to be positive."""

    def __init__(self, problem: SimulatedProblem) -> None:
        self.problem = problem
        self.model = mujoco.MjModel.from_xml_string(self.XML)
        self.data = mujoco.MjData(self.model)
        machine = problem.model.machine
        motors = [machine.joint(j).dc_motor for j in (1, 2, 3)]
        self.gear = np.array([m.gear_ratio.value for m in motors])
        self.torque = np.array([m.torque_constant.value / m.resistance.value for m in motors])
        self.rotor = np.array([m.rotor_inertia.value for m in motors])
        sensors = [machine.calibration(j) for j in (1, 2, 3)]
        self.zero = np.array([s.angle_at_zero_rad for s in sensors])
        self.count = np.array([s.range_rad / 4096 for s in sensors])
        postures = [(r.inputs.set_points - self.zero) / (self.count * 4.096) for r in problem.records]
        self.set_points = [np.floor(np.floor(p + 0.5) * 4.096 + 0.5) for p in postures]
        self.evaluations = 0

    def residual(self, values: Floats) -> Floats:
        """Simulated − measured of every record, where it is compared, in units of the noise."""
        self.evaluations += 1
        v = dict(zip(NAMES, values.tolist(), strict=True))
        self._write(v)
        found = []
        for own, set_points in zip(self.problem.records, self.set_points, strict=True):
            error = self._angles(own.inputs.initial[:, 0], own.inputs.first_drive, set_points, v) - own.measured
            found += [error[run].ravel() for run in own.runs]
        return np.asarray(np.concatenate(found) / self.problem.floor[0])

    def _write(self, v: dict[str, float]) -> None:
        m, a2, a3, load = self.model, v["link2.length"], v["link3.length"], v["load.mass"]
        mass3 = v["link3.mass"] + load
        centre3 = (0.5 * v["link3.mass"] + load) * a3 / mass3
        across3 = v["link3.mass"] * a3**2 / 3 + load * a3**2 - mass3 * centre3**2
        across2 = v["link2.mass"] * a2**2 / 12
        turn = 0.5 * v["link1.mass"] * v["link1.radius"] ** 2
        m.body_mass[1:] = v["link1.mass"], v["link2.mass"], mass3
        m.body_inertia[1:] = (turn, turn, turn), (self.THIN, across2, across2), (self.THIN, across3, across3)
        m.body_ipos[2:] = (0.5 * a2, 0, 0), (centre3, 0, 0)
        m.body_pos[3] = (a2, 0, 0)
        emf = np.array([v[TIED_BACK_EMF], v["joint2.motor.back_emf_constant"], v[TIED_BACK_EMF]])
        viscous = np.array([v[f"joint{j}.viscous_friction.coefficient"] for j in (1, 2, 3)])
        m.dof_armature[:] = self.gear**2 * self.rotor
        m.dof_damping[:] = self.gear**2 * (self.torque * emf + viscous)
        mujoco.mj_setConst(m, self.data)

    def _angles(self, start: Floats, first: Floats, set_points: Floats, v: dict[str, float]) -> Floats:
        m, d = self.model, self.data
        weight2, weight3 = 9.81 * v["link2.mass"], 9.81 * (v["link3.mass"] + v["load.mass"])
        early = round(DELAY / SUBSTEP)
        late = round(PERIOD / SUBSTEP) - early
        mujoco.mj_resetData(m, d)
        d.qpos[:] = start
        per_count = 2.0 * VOLTS_PER_COUNT * self.gear * self.torque
        most = 36.0 * self.gear * self.torque
        d.qfrc_applied[:] = first * self.gear * self.torque
        found = np.empty((len(set_points), 3))
        for k, wanted in enumerate(set_points):
            q = d.qpos
            found[k] = q
            s2, c2, s23, c23 = np.sin(q[1]), np.cos(q[1]), np.sin(q[1] + q[2]), np.cos(q[1] + q[2])
            m.dof_frictionloss[:] = v[TIED_ARM] * np.abs(
                (weight2 * s2 * c2 + weight3 * s23 * c23, weight2 * s2 + weight3 * s23 * np.cos(q[2]), weight3 * s23)
            )
            torque = np.clip((wanted - (q - self.zero) / self.count) * per_count, -most, most)
            mujoco.mj_step(m, d, early)
            d.qfrc_applied[:] = torque
            mujoco.mj_step(m, d, late)
        return found


def ours(problem: SimulatedProblem, begin: Floats) -> Run:
    """Least squares with exact derivatives; ours."""
    problem = replace(problem, memory={})
    watch = Watch()
    search = Search(robust=False, tolerance=0.5 / _samples(problem))
    found = solve(problem, [white(d) for d in problem.floor], begin, Never(), search)
    return Run(*watch.passed(), _error(problem, found.values), found.evaluations)


def simplex(problem: SimulatedProblem, begin: Floats, goal: float, limit: int) -> Run:
    """Nelder and Mead in our engine until they reach the goal."""
    problem = replace(problem, memory={})
    watch = Watch()
    found = climb(problem, begin, Never(), limit, tolerance=1e-12, goal=goal)
    return Run(*watch.passed(), _error(problem, found.values), found.evaluations)


def sysid(problem: SimulatedProblem, begin: Floats) -> Run | str:
    """`mujoco.sysid`, or the package that it lacks."""
    try:
        optimize: Any = importlib.import_module("mujoco.sysid._src.optimize")
        parameter: Any = importlib.import_module("mujoco.sysid._src.parameter")
    except ModuleNotFoundError as missing:
        return f"{missing}; pip install 'mujoco[sysid]'"
    arm = Arm(problem)
    parameters = parameter.ParameterDict()
    for unknown, value in zip(problem.unknowns, begin, strict=True):
        parameters.add(parameter.Parameter(unknown.name, value, unknown.low, unknown.high))

    def residual(x: Floats, _parameters: Any, **_: Any) -> tuple[list[Floats], Any, Any]:
        return [arm.residual(np.asarray(x))], None, None

    watch = Watch()
    best, _ = optimize.optimize(
        parameters, residual, optimizer="scipy", verbose=False, x_scale="jac", ftol=0.5 / _samples(problem)
    )
    passed, evaluations = watch.passed(), arm.evaluations
    error = float(np.mean(arm.residual(best.as_vector()) ** 2)) * float(problem.floor[0]) ** 2
    return Run(*passed, error, evaluations)


def _samples(problem: SimulatedProblem) -> int:
    """Number of compared values."""
    return 3 * sum(run.stop - run.start for runs in problem.runs for run in runs)


def _error(problem: SimulatedProblem, values: Floats) -> float:
    evaluations = problem.evaluate(values, derivatives=False)
    found = [e.residual[run].ravel() for e, runs in zip(evaluations, problem.runs, strict=True) for run in runs]
    return float(np.mean(np.concatenate(found) ** 2))


def compared(problem: SimulatedProblem, begin: Floats, limit: int) -> list[Figure]:
    """Figures of all three, with the ratio of their times to ours."""
    share = 1 + 1 / _samples(problem)  # by which an error may be larger and still count as ours
    goal = 3 * ours(problem, begin).error * share  # the simplex sums over the joints
    found = best_in_turn(
        {
            "ours": lambda: ours(problem, begin),
            "mujoco.sysid": lambda: sysid(problem, begin),
            "Nelder and Mead": lambda: simplex(problem, begin, goal, limit),
        }
    )
    own = found["ours"]
    assert isinstance(own, Run)
    figures = [Figure("ours", _text(own, problem))]
    for name, factor in (("mujoco.sysid", 10.0), ("Nelder and Mead", 50.0)):
        run = found[name]
        if isinstance(run, str):
            figures.append(Figure(name, "not compared", beside=run))
            continue
        figures.append(Figure(name, _text(run, problem)))
        figures.append(beside_ours(name, own, run, factor, share))
    return figures


def best_in_turn(fits: Mapping[str, Callable[[], Run | str]]) -> dict[str, Run | str]:
    """The quickest run of each after one to warm up; they take turns, so that all meet the same load of the machine.

    One that cannot be run says why, and is asked once.
    """
    found = {name: fit() for name, fit in fits.items()}
    able = {name: fit for name, fit in fits.items() if not isinstance(found[name], str)}
    turns = [{name: fit() for name, fit in able.items()} for _ in range(REPEATS)]
    for name in able:
        runs = [run for turn in turns if isinstance(run := turn[name], Run)]
        found[name] = min(runs, key=lambda run: run.seconds)
    return found


def beside_ours(name: str, own: Run, run: Run, factor: float, share: float) -> Figure:
    """By how much ours is quicker; a rival whose error stays above ours times `share` is told to have ended early."""
    note = f"by the clock {run.wall / own.wall:.3g} ×"
    if run.error > own.error * share * (1 + 1e-9):
        note += "; it did not get as far as ours"
    return at_least(f"ours is quicker than {name} by", run.seconds / own.seconds, factor, "×", note)


def _text(run: Run, problem: SimulatedProblem) -> str:
    noises = run.error**0.5 / problem.floor[0]
    return f"{run.seconds:.2f} s ({run.wall:.2f} s by the clock), {noises:.4f} noises, {run.evaluations} evaluations"


def fit_of_thirteen(seconds: float) -> tuple[SimulatedProblem, Floats, Floats]:
    """The problem, where the fits begin, and the true values; parameters in the order of `NAMES`."""
    machine = load_machine("ma2000")
    start = thirteen(machine)
    begin = np.array([start.parameter(n).value for n in NAMES])
    truth = begin * (1 + SPREAD * np.random.default_rng(7).standard_normal(len(NAMES)).clip(-2, 2))
    plant = plant_text(hidden(dict(zip(NAMES, truth.tolist(), strict=True))))
    traces = recorded(experiments(seconds), machine, 7, plant, board_text(0.0))
    options = FitOptions(
        parameters=NAMES,
        use_priors=False,
        robust=False,
        start_posture=False,
        sensor_bend=False,
        friction_form=False,
        bounds={n: (0.4 * v, 2.0 * v) for n, v in zip(NAMES, begin.tolist(), strict=True)},
    )
    problem = fit_problem(start, traces, options)
    order = [u.name for u in problem.unknowns]
    return replace(problem, unknowns=tuple(problem.unknowns[order.index(n)] for n in NAMES), memory={}), begin, truth


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks fitting", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="records of 5 s, a tenth of the simplex's evaluations")
    given = parser.parse_args()
    seconds, limit = (5.0, SIMPLEX_LIMIT // 10) if given.quick else (12.0, SIMPLEX_LIMIT)
    problem, begin, truth = fit_of_thirteen(seconds)
    first, best = (_error(problem, v) ** 0.5 / problem.floor[0] for v in (begin, truth))
    title = f"13 parameters from four traces of {seconds:g} s; {first:.2f} noises at first, {best:.4f} at the truth"
    return show(title, "python -m benchmarks fitting", compared(problem, begin, limit))


if __name__ == "__main__":
    sys.exit(main())
