"""How time and memory of run, fit, validate, diagnose and serve grow: docs/images/cost-curves.svg.

    python -m benchmarks cost_curves               measure, print and draw (20 minutes)

Every point is a process of its own that has the code and the records: processor time, and the most memory that it takes
besides. A curve's exponent is the slope of its logarithms over its upper half.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import ma2000
from benchmarks.service_clients import clients
from benchmarks.service_load import ProcessorTime
from benchmarks.service_process import ROBOT, started_service, sway
from benchmarks.waits import resident
from daq.contracts.trace import Trace
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate, simulate_many

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "cost-curves.svg"
ARMS = {1: "pendulum", 3: "ma2000", 6: "ur10e", 7: "panda"}
"""A machine for each number of joints."""
WATCHED = 20.0  # s for which a service is measured
FITTED = ("joint2.motor.back_emf_constant", "joint2.viscous_friction.coefficient", "load.mass")
Cost = tuple[float, float]
"""Processor time (s) and memory (bytes)."""


def record(folder: Path, seconds: float, seed: int = 0) -> Path:
    """Records the mock's joints 1 to 3 at 50 Hz."""
    trajectory = {"kind": "multisine", "duration": seconds, "seed": seed}
    with ma2000.connect("mock://?lock_step=1") as arm:
        return arm.run(ma2000.ExperimentSpec.model_validate({"trajectory": trajectory}), folder=folder).file


def pushed(joints: int, traces: list[Trace]) -> None:
    """A drive moves an arm for 10 s, in the recursive form that any arm has."""
    model = base_model(ma2000.load_machine(ARMS[joints]))
    at = 0.02 * np.arange(500)
    posture = np.tile(traces[0].position[0, :1], (500, joints))
    drive = 0.01 * np.sin(at)[:, None] * np.ones(joints)
    trace = Trace(traces[0].record, tuple(range(1, joints + 1)), at, position=posture, drive=drive)
    simulate(model, trace, Options(loop="open", general=True))


def studied(study: str, joints: int, traces: list[Trace]) -> None:
    """One study of these records."""
    model = base_model(ma2000.load_machine("ma2000"))
    if joints:
        pushed(joints, traces)
    elif study == "run":
        simulate_many(model, traces, {})
    elif study == "fit":
        ma2000.fit(model, traces, ma2000.FitOptions(parameters=FITTED), progress=False)
    elif study == "validate":
        ma2000.validate(model, traces, FITTED, progress=False)
    else:
        ma2000.diagnose(model, traces, progress=False)


def measure(pipe: Connection, study: str, joints: int, traces: list[Trace]) -> None:
    """Sends what a study costs in this process."""
    begun, had = time.process_time(), resident(os.getpid())
    studied(study, joints, traces)
    took = time.process_time() - begun
    pipe.send((took, 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - had))


def cost(study: str, joints: int, files: list[Path]) -> Cost:
    """What a study costs in a process of its own, the least of two (of a diagnosis: one).

    The process is a copy of this one, which has the code and the traces.
    """
    context = multiprocessing.get_context("fork")
    traces, found = [ma2000.read_trace(file) for file in files], []
    studied(study, joints, traces[:1])
    for _ in range(1 if study == "diagnose" else 2):
        ours, theirs = context.Pipe()
        process = context.Process(target=measure, args=(theirs, study, joints, traces[1:]))
        process.start()
        theirs.close()
        found.append(ours.recv())
        process.join()
    return min(took for took, _ in found), min(memory for _, memory in found)


def watched(watchers: int) -> Cost:
    """What a service takes to show a moving arm to so many watchers, a second; and its memory."""
    with tempfile.TemporaryDirectory() as name, started_service(Path(name), "mock://") as service:
        service.ask("POST", "/connect")
        number = service.submit(sway(3 * WATCHED))
        service.until_recording(number)
        with clients(service.url, watchers, ("/healthz",), 1.0, f"/api/v1/robots/{ROBOT}/live"):
            spent = ProcessorTime({"service": [service.process.pid]})
            time.sleep(WATCHED)
            share = spent.shares()["service"]
            memory = resident(service.process.pid)
        service.ask("POST", "/stop")
    return share, memory


def curves(folder: Path, points: int) -> Iterator[tuple[str, str, list[tuple[float, Cost]]]]:
    """Yields against what, of what, and the points of each curve."""
    short = record(folder, 2.0)
    lengths = {10.0 * 2**k: record(folder, 10.0 * 2**k, 1) for k in range(points + 4)}
    several = [record(folder, 10.0, seed) for seed in range(2, 2 + 2 ** (points - 1))]
    for study in ("run", "fit", "validate", "diagnose"):
        some = [*lengths.items()][4:] if study == "run" else [*lengths.items()][:points]  # a run takes milliseconds
        yield "s of record", study, [(s, cost(study, 0, [short, file])) for s, file in some]
        counts = [2**k for k in range(points)]
        yield "traces of 10 s", study, [(n, cost(study, 0, [short, *several[:n]])) for n in counts]
    yield "joints", "run", [(joints, cost("run", joints, [short, short])) for joints in ARMS]
    yield "watchers", "serve", [(n, watched(n)) for n in (5, 10, 20, 40, 80)[:points]]


def exponent(points: list[tuple[float, float]]) -> float:
    """Slope of the logarithms over the upper half of a curve: below, what is constant hides it."""
    upper = [(math.log(x), math.log(y)) for x, y in points[len(points) // 2 - 1 :] if y > 0]
    return statistics.linear_regression(*zip(*upper, strict=True)).slope if len(upper) > 1 else math.nan


def draw(found: Iterable[tuple[str, str, list[tuple[float, Cost]]]]) -> None:
    """Prints the curves and draws them: a column for what the costs are taken against, a row for time and memory."""
    figure = Figure(figsize=(11, 5), layout="constrained")
    axes = figure.subplots(2, 4, sharex="col", sharey="row")
    columns: dict[str, int] = {}
    for against, what, points in found:
        column = columns.setdefault(against, len(columns))
        for row, (named, unit) in enumerate((("time (s)", 1.0), ("memory (MB)", 2.0**20))):
            line = [(x, costs[row] / unit) for x, costs in points]
            told = f"{what} ∝ x^{round(exponent(line), 1) + 0.0:.1f}"
            axes[row][column].loglog(*zip(*line, strict=True), "o-", label=told, markersize=4)
            axes[row][column].set_xticks([x for x, _ in line], [f"{x:g}" for x, _ in line])
            axes[row][column].minorticks_off()
            axes[row][column].legend(fontsize=7)
            values = ", ".join(f"{x:g}: {y:.3g}" for x, y in line)
            print(f"{named} against {against}, {told}: {values}", flush=True)
        axes[1][column].set_xlabel(against)
    axes[0][0].set_ylabel("processor time (s)")
    axes[1][0].set_ylabel("memory (MB)")
    mpl.rcParams["svg.hashsalt"] = "cost curves"  # the same names in the file each time
    figure.savefig(PICTURE, metadata={"Date": None})


def main() -> int:
    """Measures, prints and draws; 0."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks cost_curves", description=__doc__)
    parser.add_argument("--points", type=int, default=4)
    with tempfile.TemporaryDirectory() as folder:
        draw(curves(Path(folder), parser.parse_args().points))
    return 0


if __name__ == "__main__":
    sys.exit(main())
