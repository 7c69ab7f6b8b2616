"""Simulation of the arm in closed loop: speed beside C and MuJoCo, Jacobian, scaling, first use, step size.

    python -m benchmarks.simulation [--cold]

One run is 2 s of the ramp step (21.6° in 0.65 s), joints 1-3, control every 20 ms, RK4 in steps of at most 1 ms. The C
version has the same algorithm and the same effects compiled in: on are the viscous friction and the friction that goes
with the load, for which the machine file has numbers, and all others are off; both are checked to agree. MuJoCo gets
the same viscous friction and a Coulomb friction of its own. Times are the best of equally many, taken in turn, on
whatever machine this runs. Needs gcc.
"""

from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks.figures import Figure, at_least, at_most, show
from daq.contracts.machine import load_machine
from model import layout as at
from model.drives import controller as pid
from model.drives.magnet import torque_constant
from model.dynamics.rod_arm import RodArm
from model.machine_model.model import Model, base_model
from model.simulation.batch import BatchRun, available_cores
from model.simulation.bodies import rod_arm_body
from model.simulation.inputs import RunInputs
from model.simulation.period import OUT_POSITION, OUTPUTS
from model.simulation.prepared import LONGEST_STEP, Options, Prepared, prepare
from model.simulation.simulate import sensitivities, simulate
from tests.model.dynamics.oracles import mjcf
from tests.model.simulation.records import ramp_inputs

REPEATS = 40
BATCH = 1000
JACOBIAN = (
    "link1.mass",
    "link2.mass",
    "link3.mass",
    "load.mass",
    "link2.length",
    "link3.length",
    "joint1.motor.back_emf_constant",
    "joint2.motor.back_emf_constant",
    "joint3.motor.back_emf_constant",
    "joint1.viscous_friction.coefficient",
    "joint2.viscous_friction.coefficient",
    "joint3.viscous_friction.coefficient",
    "joint2.load_dependent_friction.arm",
)
"""The thirteen parameters of table 7.9's model that derivatives are taken for."""
FOLDER = Path(__file__).parent
Pointer = ctypes.POINTER(ctypes.c_double)


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.simulation", description=__doc__)
    parser.add_argument("--cold", action="store_true", help="also time a first use with nothing compiled (a minute)")
    cold = parser.parse_args().cold
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine)
    prepared = prepare(model, inputs, Options())
    figures = [*_one_run(model, inputs, prepared), *_scaling(model, prepared), *_first_use(cold)]
    _step_sizes(model, inputs)
    return show("The simulation", "python -m benchmarks simulation", figures)


def _one_run(model: Model, inputs: RunInputs, prepared: Prepared) -> list[Figure]:
    """One run beside C and MuJoCo, and its derivatives."""
    ours, c = our_runs(model, prepared, 1), c_runs(model, prepared, 1)
    check_agreement(ours, c)
    one, rival, plant = _best_in_turn(lambda: ours(1), lambda: c(1), _mujoco_run(inputs))
    parameters = [model.parameter(name) for name in JACOBIAN]
    jacobian = _best(lambda: sensitivities(model, inputs, parameters), REPEATS)
    one_dual = _best(lambda: sensitivities(model, inputs, parameters[:1]), REPEATS)
    cores = available_cores()
    return [
        at_most("one closed-loop run, numba", one / rival, 1.3, "× C", f"{_ms(one)}; C -O3 -march=native {_ms(rival)}"),
        at_least("MuJoCo, driven from Python each control tick", plant / one, 10.0, "× ours", _ms(plant)),
        Figure("one parameter's sensitivity (dual numbers)", f"{one_dual / one:.2f} runs", beside=_ms(one_dual)),
        at_most("exact Jacobian, 13 parameters", jacobian / one, 40.0, "runs", f"{_ms(jacobian)} on {cores} cores"),
    ]


def _ms(seconds: float) -> str:
    return f"{seconds * 1e3:.3f} ms"


def _best(run: Callable[[], Any], repeats: int) -> float:
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def _best_in_turn(*runs: Callable[[], Any]) -> list[float]:
    """Best times of several that take turns, so that all meet the same load of the machine."""
    turns = [[_best(run, 3) for run in runs] for _ in range(REPEATS)]
    return [min(times) for times in zip(*turns, strict=True)]


def _spread(model: Model, count: int) -> NDArray[np.float64]:
    """Parameter vectors that differ a little, so that no two runs are the same."""
    vectors = np.tile(model.vector, (count, 1))
    vectors[:, at.LOAD] *= 1 + 1e-4 * np.arange(count) / count
    return vectors


def our_runs(model: Model, prepared: Prepared, count: int) -> Callable[[int], NDArray[np.float64]]:
    """Simulates on so many cores, and returns the outputs of all runs."""
    initials, which = np.tile(prepared.initial, (count, 1, 1)), np.zeros(count, np.int64)
    return BatchRun(model, (prepared,), which, _spread(model, count), initials, LONGEST_STEP).run


def c_runs(
    model: Model, prepared: Prepared, count: int, optimised: str = "-O3"
) -> Callable[[int], NDArray[np.float64]]:
    """The same in C."""
    library = _compile_c(optimised)
    periods = len(prepared.set_points)
    vectors = _spread(model, count)
    shared = np.ascontiguousarray(vectors[:, : at.SHARED])
    joints = np.ascontiguousarray(vectors[:, at.SHARED :]).reshape(count, 3, at.PER_JOINT)
    body = rod_arm_body(shared[0], joints[0], model.flags)
    out = np.zeros((count, OUTPUTS, periods, 3))
    arrays = [
        prepared.set_points,
        prepared.noise,
        prepared.initial,
        prepared.first_drive,
        shared,
        joints,
        prepared.gains,
        body,
    ]
    arrays = [np.ascontiguousarray(a) for a in arrays]
    pointers = [a.ctypes.data_as(Pointer) for a in arrays]  # they keep what they point to
    flags = np.array(model.flags, dtype=ctypes.c_long)
    deflection = _initial_deflection(model, prepared)
    tail = (
        flags.ctypes.data_as(ctypes.POINTER(ctypes.c_long)),
        deflection.ctypes.data_as(Pointer),
        ctypes.c_long(1),
        ctypes.c_double(LONGEST_STEP),
        out.ctypes.data_as(Pointer),
    )

    def piece(first: int, last: int) -> None:
        library.run_many(ctypes.c_long(first), ctypes.c_long(last), ctypes.c_long(periods), *pointers, *tail)

    def run(cores: int) -> NDArray[np.float64]:
        if cores == 1 or count == 1:
            piece(0, count)
            return out
        edges = np.linspace(0, count, cores * 4 + 1).astype(int)
        with ThreadPoolExecutor(cores) as pool:
            list(pool.map(piece, edges[:-1].tolist(), edges[1:].tolist()))
        return out

    return run


def _initial_deflection(model: Model, prepared: Prepared) -> NDArray[np.float64]:
    """What friction carries at the start: formed once a run by both, given to C."""
    from model.simulation.dynamics_of_run import rod_arm_gravity, rod_arm_levels

    joints = model.vector[at.SHARED :].reshape(3, at.PER_JOINT).copy()
    body = rod_arm_body(model.vector[: at.SHARED].copy(), joints, model.flags)
    levels, posture = np.zeros(3), prepared.initial[:, 0].copy()
    rod_arm_levels(posture, joints, body, prepared.settings, levels)
    levels += np.where(np.array(model.flags) & at.HAS_STICTION, joints[:, at.BREAKAWAY], 0.0)
    gain = [joint[at.GEAR] * torque_constant(joint) / joint[at.RESISTANCE] for joint in joints]
    return np.clip((np.array(gain) * prepared.first_drive - rod_arm_gravity(posture, joints, body)) / levels, -1.0, 1.0)


@cache
def _compile_c(optimised: str) -> Any:
    columns = {n: v for n, v in vars(at).items() if n.isupper() and isinstance(v, int)}
    columns |= {"GAIN_P": pid.P, "GAIN_I": pid.I, "GAIN_D": pid.D, "GAIN_SCALE": pid.SCALE, "GAINS": pid.GAINS}
    options = [optimised, "-march=native", "-fno-math-errno", "-shared", "-fPIC"]
    with tempfile.TemporaryDirectory(prefix="ma2000-benchmark-") as name:
        folder = Path(name)
        (folder / "layout.h").write_text("".join(f"#define {n} {v}\n" for n, v in columns.items()), encoding="utf-8")
        library = folder / "closed_loop.so"
        command = ["gcc", *options, f"-I{folder}", f"-I{FOLDER}", str(FOLDER / "closed_loop.c")]
        subprocess.run([*command, "-o", str(library), "-lm"], check=True)
        return ctypes.CDLL(str(library))  # stays loaded without its file


def check_agreement(ours: Callable[[int], Any], c: Callable[[int], Any]) -> None:
    """Raises AssertionError where the two move the arm differently."""
    difference = float(np.abs(ours(1)[0, OUT_POSITION] - c(1)[0, OUT_POSITION]).max())
    if not difference < 1e-9:
        raise AssertionError(f"the C and numba versions disagree by {difference} rad")


def _mujoco_run(inputs: RunInputs) -> Callable[[], NDArray[np.float64]]:
    """The same loop with MuJoCo as the arm: motor as torque and damping, control formed in Python each tick."""
    machine = load_machine("ma2000")
    joints = [machine.joint(j) for j in (1, 2, 3)]
    drives = [j.dc_motor for j in joints]
    gear = np.array([d.gear_ratio.value for d in drives])
    gain = gear * [d.torque_constant.value / d.resistance.value for d in drives]
    rotor = gear**2 * [d.rotor_inertia.value for d in drives]
    viscous = np.array([f.value for j in joints if (f := j.friction.viscous_motor_side) is not None])
    damping = gain * gear * [d.back_emf_constant.value for d in drives] + gear**2 * viscous
    masses = [j.link.mass.value for j in joints]
    arm = RodArm(
        masses[0],
        0.062899,
        masses[1],
        masses[2],
        1.250307,
        joints[1].geometry.a.value,
        joints[2].geometry.a.value,
        rotor_inertia=(float(rotor[0]), float(rotor[1]), float(rotor[2])),
    )
    xml = mjcf(arm.chain()).replace("armature=", 'frictionloss="1.5" armature=')
    xml = xml.replace(' constraint="disable"', "").replace('angle="radian"', 'angle="radian" boundinertia="1e-6"')
    plant = mujoco.MjModel.from_xml_string(xml)
    plant.dof_damping[:] = damping
    plant.opt.timestep = LONGEST_STEP
    data = mujoco.MjData(plant)
    count = np.array([machine.calibration(j).rad_per_count for j in (1, 2, 3)])
    zero = np.array([machine.calibration(j).angle_at_zero_rad for j in (1, 2, 3)])
    wanted = np.floor((inputs.set_points - zero) / count + 0.5)
    volts = np.array([d.scale.counts_to_volts(1.0) for d in drives])

    def run() -> NDArray[np.float64]:
        mujoco.mj_resetData(plant, data)
        data.qpos[:] = inputs.initial[:, 0]
        positions = np.zeros((len(inputs), 3))
        for k in range(len(inputs)):
            positions[k] = data.qpos
            power = np.clip(2 * (wanted[k] - np.floor((data.qpos - zero) / count + 0.5)), -127, 127)
            mujoco.mj_step(plant, data, nstep=6)
            data.qfrc_applied[:] = gain * volts * power
            mujoco.mj_step(plant, data, nstep=14)
        return positions

    return run


def _scaling(model: Model, prepared: Prepared) -> list[Figure]:
    """Many runs on every core."""
    ours, c = our_runs(model, prepared, BATCH), c_runs(model, prepared, BATCH)
    cores = available_cores()
    ways = [(name, run, n) for n in (1, cores) for name, run in (("numba", ours), ("C", c))]
    turns = [[_best(lambda r=run, n=n: r(n), 1) for _, run, n in ways] for _ in range(4)]
    best = {(name, n): min(taken) for (name, _, n), taken in zip(ways, zip(*turns, strict=True), strict=True)}
    times = {name: (best[name, 1], best[name, cores]) for name in ("numba", "C")}
    told = [
        f"{name} {single / several:.2f} × on {cores} cores, {several / BATCH * 1e6:.0f} µs a run"
        for name, (single, several) in times.items()
    ]
    share = (times["numba"][0] / times["numba"][1]) / (times["C"][0] / times["C"][1])
    name = f"{BATCH} runs with different parameters, scaling beside that of C"
    return [at_least(name, 100 * share, 90.0, "%", "; ".join(told))]


def _step_sizes(model: Model, inputs: RunInputs) -> None:
    """Largest error of each joint's angle against steps of 1/32 ms, without rounding."""

    def positions(step: float) -> NDArray[np.float64]:
        return simulate(model, inputs, Options(quantise=False, step=step)).position

    exact = positions(1e-3 / 32)
    sys.stdout.write("longest step   largest error of joints 1, 2, 3 (rad)\n")
    for step in (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4):
        errors = np.abs(positions(step) - exact).max(axis=0)
        sys.stdout.write(f"  {step * 1e3:5.2f} ms    " + "  ".join(f"{e:.1e}" for e in errors) + "\n")


_FIRST_USE = """
import sys
import time
start = time.perf_counter()
from tests.model.simulation.records import ramp_inputs
from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.simulate import sensitivities, simulate
model = base_model(load_machine("ma2000"))
inputs = ramp_inputs(model.machine)
loaded = time.perf_counter()
simulate(model, inputs)
once = time.perf_counter()
sensitivities(model, inputs, [model.parameter(name) for name in sys.argv[1:]])
print(f"{loaded - start:.2f} {once - loaded:.2f} {time.perf_counter() - once:.2f}")
"""


def _first_use(cold: bool) -> list[Figure]:
    """A new process: import, first simulation, first sensitivities, with the compiled cache cold and warm."""
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        for state in ("cold", "warm") if cold else ("warm",):
            environment = {**os.environ, **({"NUMBA_CACHE_DIR": folder} if cold else {})}
            done = subprocess.run(
                [sys.executable, "-c", _FIRST_USE, *JACOBIAN],
                env=environment,
                capture_output=True,
                text=True,
                check=True,
                cwd=FOLDER.parent,
            )
            loaded, once, dual = (float(x) for x in done.stdout.split()[-3:])
            if state == "cold":
                figures.append(at_most("first simulation, nothing compiled", once, 20.0, "s"))
                figures.append(at_most("first sensitivities, nothing compiled", dual, 20.0, "s"))
            else:
                told = f"import {loaded:.2f} s, first simulation {once:.2f} s, first sensitivities {dual:.2f} s"
                figures.append(at_most("first use, machine code on disk", loaded + once + dual, 1.0, "s", told))
    return figures


if __name__ == "__main__":
    sys.exit(main())
