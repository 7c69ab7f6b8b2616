"""The figures on which the pages rest, each divided by its floor or rival in the same run: `make bench`.

    python -m benchmarks ledger             measure, and compare with the last ten lines of ledger.csv
    python -m benchmarks ledger --record    the same, and add a line for this commit

Times are of the processor, and the least of several, so that other programs matter little. A figure that is more than a
tenth above the median of the lines before is named, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import csv
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import httpx
import mujoco
import numpy as np
import zstandard
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from benchmarks.figures import Figure, show
from benchmarks.mock_arm import record
from benchmarks.mock_process import environment_of
from benchmarks.service_process import children, started_service
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.processor import added, processor_time
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceRecord
from daq.driver import Controller
from daq.traces.layout import RECORDED_SIGNALS
from daq.traces.naming import new_trace_id
from daq.traces.reader import read_trace
from daq.traces.recording import Recording
from mock_controller.device import build_device
from mock_controller.options import Options
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.machine_model.model import base_model
from model.simulation.inputs import inputs_of
from model.simulation.simulate import sensitivities, simulate, simulate_many

KEPT = Path(__file__).with_name("ledger.csv")
COMPARED = 10
"""Recorded lines that a run is compared with."""
WORSE = 1.1
PERIOD_US = 20_000
RATE = 50
"""Sampling rate (Hz)."""
STEPS = 20
"""Steps of 1 ms that the mock's engine takes in a control period."""
MANY = 2048
"""Runs of an ensemble."""
WANTED = 2 * 240 / 1e6 / 100
"""Processor time (s) of a period for a million runs of 2 s in four minutes on two cores."""
ENGINE = f"MuJoCo's {STEPS} steps"
CACHED = """import numba, numpy, pydantic
@numba.njit(cache=True)
def total(values):
    return values.sum()
total(numpy.zeros(3))
"""
"""The least program that calls code which numba has compiled before."""
FITTED = (
    *(f"joint{joint}.motor.{name}" for joint in (1, 2, 3) for name in ("back_emf_constant", "rotor_inertia")),
    *(f"joint{joint}.viscous_friction.coefficient" for joint in (1, 2, 3)),
    *(f"joint{joint}.load_dependent_friction.arm" for joint in (1, 2, 3)),
    "load.mass",
)
"""The thirteen parameters of the figures on fitting."""


@dataclass(frozen=True)
class Entry:
    """One figure: what it took and what its floor or rival took (s), and the largest ratio that is wanted."""

    name: str
    took: float
    beside: str
    floor: float
    target: float | None = None

    @property
    def ratio(self) -> float:
        """How many times its floor or rival."""
        return self.took / self.floor

    @property
    def column(self) -> str:
        """Its column in `ledger.csv`: a ratio to something else is another figure."""
        return f"{self.name} : {self.beside}"


def least(act: Callable[[], object], times: int) -> float:
    """Least processor time (s) of this process for one act."""
    found = []
    for _ in range(times):
        begun = time.process_time()
        act()
        found.append(time.process_time() - begun)
    return min(found)


def of_program(*arguments: str, times: int) -> float:
    """Least processor time (s) of a Python program and its children, from its start to its end. Raises RuntimeError."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(times):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [sys.executable, *arguments]
            environment = environment_of(Path(folder))
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(f"{' '.join(arguments)}: {done.stderr.strip()}")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(found)


def of_service(folder: Path) -> float:
    """Processor time (s) of `daq serve` and its stop listener until its first answer. No robot is connected."""
    (folder / "daq.toml").write_text("[server]\nconnect_at_start = false\n", "utf-8")
    with started_service(folder, "mock://") as service:
        httpx.get(f"{service.url}/healthz").raise_for_status()
        every = (service.process.pid, *children(service.process.pid, b"server.stopping"))
        taken = added(map(processor_time, every))
    assert taken is not None, "this kernel does not count"
    return taken.ran


def starts(times: int) -> Iterator[Entry]:
    """Commands, the package and the service, beside a Python that does nothing, or only imports their libraries."""
    bare = of_program("-c", "pass", times=times)
    command = "import sys; sys.argv = ['daq', *{!r}]; from daq_cli import main; main()"
    for name, program in (
        ("daq --help", command.format(["--help"])),
        ("daq stop --help", command.format(["stop", "--help"])),
        ("daq run ramp --help", command.format(["run", "ramp", "--help"])),
        (
            "a ramp in lock-step, with its start",
            command.format(["--port", "mock://?lock_step=1", "run", "ramp", "--json"]),
        ),
        ("import ma2000", "import ma2000"),
        ("an owner's imports", "import daq.owner.process"),
        ("the stop listener's imports", "import server.stopping.process"),
    ):
        yield Entry(name, of_program("-c", program, times=times), "python -c pass", bare)
    libraries = of_program("-c", "import fastapi, numpy, sqlalchemy.orm, uvicorn", times=times)
    with tempfile.TemporaryDirectory() as folder:
        service = min(of_service(Path(folder)) for _ in range(1 + times // 2))
    yield Entry("daq serve to its first answer", service, "its libraries' import", libraries)


@contextmanager
def a_ramp(times: int, periods: list[float]) -> Iterator[Path]:
    """The trace of a default ramp in lock-step; `periods`: the processor time (s) of a period in each of some ramps."""
    machine = load_machine("ma2000")
    with Controller.connect("mock://?lock_step=1") as controller, tempfile.TemporaryDirectory() as folder:
        for _ in range(1 + times):
            tick, begun = controller.status().tick, time.process_time()
            trace = record(controller, ExperimentSpec(), machine, Path(folder))
            periods.append((time.process_time() - begun) / (controller.status().tick - tick))
        yield trace


def simulated(times: int) -> Iterator[Entry]:
    """Lock-step, and runs of the model, beside the engine that moves the mock's arm."""
    board = build_device(Options(lock_step=True), lambda _: None).board
    board.run_until(100 * PERIOD_US)
    own, data = board.plant._model, board.plant._data  # the engine itself, without the mock
    engine = least(lambda: [mujoco.mj_step(own, data) for _ in range(50 * STEPS)], 10 * times) / 50
    alone = least(lambda: board.run_until(board.time_us + 50 * PERIOD_US), 10 * times) / 50
    periods: list[float] = []
    with a_ramp(3 * times, periods) as path:
        trace = read_trace(path)
        first = (
            "import ma2000; ma2000.simulate(ma2000.base_model(ma2000.load_machine('ma2000')), ma2000.read_trace({!r}))"
        )
        fresh = of_program("-c", first.format(str(path)), times=times)
        cached = Path(path.parent, "cached.py")
        cached.write_text(CACHED, "utf-8")
        compiler = of_program(str(cached), times=1 + times)  # the first compiles
    yield Entry("lock-step, a period with its trace", min(periods), ENGINE, engine, PERIOD_US * 1e-6 / 40 / engine)
    yield Entry("lock-step, the mock alone", alone, ENGINE, engine, PERIOD_US * 1e-6 / 150 / engine)
    yield Entry("a first simulation", fresh, "numba's first call of a cached function", compiler)
    model = base_model(load_machine("ma2000"))
    inputs = inputs_of(trace, model.machine)
    free = [model.parameter(name) for name in FITTED]
    run = least(lambda: simulate(model, inputs), 50 * times)
    yield Entry("a closed-loop run, a period", run / len(inputs), ENGINE, engine)
    jacobian = least(lambda: sensitivities(model, inputs, free), 10 * times)
    yield Entry("exact derivatives by 13 parameters", jacobian, "one run", run, 12.0)
    masses = {"load.mass": np.linspace(1.0, 1.5, MANY)}
    many = least(lambda: simulate_many(model, [inputs], masses), 2) / MANY / len(inputs)
    yield Entry(
        "one of many closed-loop runs, a period", many, "one run's", run / len(inputs), WANTED / run * len(inputs)
    )
    fitted = least(lambda: fit(model, [trace], FitOptions(parameters=FITTED)), 2)
    yield Entry("a fit of 13 parameters", fitted, "one run", run)


def rows(minutes: float, joints: int) -> list[SampleRow]:
    """Sines with the noise and the rounding of a 12-bit sensor, a few degrees behind their set points."""
    rng = np.random.default_rng(1)
    count = round(minutes * 60 * RATE)
    time_s = np.arange(count)[:, None] / RATE
    adc_count, posture_unit = 4.71 / 4096, 4.71 / 1000
    angle = 2.0 + 0.4 * np.sin(2.1 * time_s + np.arange(joints))
    position = np.round((angle + rng.normal(0, 0.002, angle.shape)) / adc_count) * adc_count
    set_point = np.round((2.0 + 0.4 * np.sin(2.1 * time_s + np.arange(joints) + 0.1)) / posture_unit) * posture_unit
    error = set_point - position
    power = np.clip(np.round(2 * error / adc_count), -127, 127).astype(int)
    arrival = 1000.0 + time_s[:, 0] + np.abs(rng.normal(0, 0.0004, count))
    columns = (set_point, position, error, power * 0.28, power)
    return [
        SampleRow(tick, tick / RATE, at, tuple(s), tuple(p), tuple(e), tuple(d), tuple(w))
        for tick, (at, s, p, e, d, w) in enumerate(zip(arrival.tolist(), *(c.tolist() for c in columns), strict=True))
    ]


def read(times: int) -> Iterator[Entry]:
    """An hour of three joints: recorded, opened, and opened again."""
    samples = rows(60.0, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trace.mcap"
        about = TraceRecord(
            trace_id=new_trace_id(),
            created=datetime.now(UTC),
            software="benchmark",
            source="mock",
            machine=load_machine("ma2000"),
            period=1 / RATE,
            drive_unit="V",
        )

        def record_all() -> None:
            with path.open("xb") as stream:
                recording = Recording(stream, about, (1, 2, 3), RECORDED_SIGNALS, {})
                for row in samples:
                    recording.row(row)
                    if row.tick % 40 == 0:  # as often as in real time
                        recording.flush()
                recording.finish("complete", {})

        def inflated() -> None:
            for chunk in chunks:
                zlib.crc32(zstandard.decompress(chunk.data, chunk.uncompressed_size))

        recorded, first = least(record_all, 1), least(lambda: read_trace(path), 1)
        again = least(lambda: read_trace(path), 3 * times)
        with path.open("rb") as stream:
            chunks = [one for one in StreamReader(stream, emit_chunks=True).records if isinstance(one, Chunk)]
        floor, checked = least(inflated, 3), least(lambda: zlib.crc32(path.read_bytes()), 3 * times)
    yield Entry("an hour of trace, recorded", recorded, "zstd and checksums read it", floor)
    yield Entry("an hour of trace, first opened", first, "zstd and checksums read it", floor, 0.2 / floor)
    yield Entry("an hour of trace, opened again", again, "its checksum", checked, 0.02 / checked)


def kept() -> list[dict[str, str]]:
    """The recorded lines, the oldest first."""
    if not KEPT.exists():
        return []
    with KEPT.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def keep(entries: list[Entry], lines: list[dict[str, str]]) -> None:
    """Writes the recorded lines with one more for the present commit; figures that there are no more go."""
    asked = ("git", "describe", "--always", "--dirty", "--exclude=*")
    commit = subprocess.run(asked, cwd=KEPT.parent, capture_output=True, text=True, check=True).stdout.strip()
    line = {"commit": commit, **{entry.column: f"{entry.ratio:.3g}" for entry in entries}}
    with KEPT.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, list(line), extrasaction="ignore", restval="", lineterminator="\n")
        table.writeheader()
        table.writerows([*lines, line])


def compared(entry: Entry, lines: list[dict[str, str]]) -> Figure:
    """A figure beside what was recorded of it."""
    before = [float(line[entry.column]) for line in lines[-COMPARED:] if line.get(entry.column)]
    usual = statistics.median(before) if before else None
    worse = usual is not None and entry.ratio > WORSE * usual
    past = ", ".join(f"{value:g}" for value in before)
    missed = entry.target is not None and entry.ratio > entry.target
    target = "" if entry.target is None else f"≤ {entry.target:.3g}"
    beside = f"{entry.took * 1e3:.3g} ms : {entry.beside} {entry.floor * 1e3:.3g} ms"
    told = f"{beside}   {'WORSE than ' if worse else ''}before: {past}"
    met = None if entry.target is None and not worse else not (worse or missed)
    return Figure(entry.name, f"{entry.ratio:.3g}", target, met, told)


def main() -> int:
    """The exit code: 1 where a figure has become worse or misses its target."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks ledger", description=__doc__)
    parser.add_argument("--record", action="store_true", help="add a line to ledger.csv")
    parser.add_argument("--times", type=int, default=11, help="repeats of each figure (11)")
    given = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    lines = kept()
    entries = [entry for part in (simulated, read, starts) for entry in part(given.times)]
    figures = [compared(entry, lines) for entry in entries]
    code = show("Times their floor or rival", "python -m benchmarks ledger", figures)
    if given.record:
        keep(entries, lines)
    return code


if __name__ == "__main__":
    sys.exit(main())
