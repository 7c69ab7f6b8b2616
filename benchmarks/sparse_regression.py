"""Sparse regression in the manner of SINDy, naming effects from traces: the rival of `daq diagnose`.

    python -m benchmarks sparse_regression TRACE…            effects, best first, for each trace
    python -m benchmarks sparse_regression --trial FOLDER    beside the diagnosis, on the scored cases of a trial

Brunton, Proctor and Kutz (2016) with a library of physics instead of polynomials, which is the most that such a
regression can be given here. The rigid bodies and motors of the model are taken off first: inverse dynamics on smoothed
derivatives, the drive smoothed alike and shifted to when it acts, where joints move. Tolerances of the model may answer
with the deviations that the machine file expects of them. Every effect that the diagnosis knows has its own terms,
those that need a shape at several shapes; frequencies of disturbances and cycles of ripples are the peaks of the
residual's periodogram, over time and over angle. pysindy's sequentially thresholded least squares then keeps few terms;
an effect ranks by the threshold up to which one of its terms survives. A wrong gain and lost set points are regressed
where they act, on the recorded drive.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pysindy
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
from scipy.signal import find_peaks, lombscargle, savgol_filter

from benchmarks.figures import Figure, show
from benchmarks.smoothed_torques import TorquesAlongTrace, torques_along
from daq.contracts.errors import TraceError
from daq.contracts.machine import BoardPid
from daq.contracts.trace import Trace
from daq.traces.reader import read_trace
from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import holds_drive_between_samples
from model.machine_model.model import Model, base_model

Mask = NDArray[np.bool_]
Place = tuple[str, int | None]
"""An effect, and the joint (from 1) it is on; None for the whole machine."""

WINDOW = 0.26
"""Window (s) of the local polynomials that give speeds and accelerations; shorter ones let noise through."""
THRESHOLDS = np.geomspace(1.0, 0.01, 16)
"""Thresholds of normalised coefficients, as shares of the target's deviation."""
RIDGE = 0.05
"""Ridge penalty as a share of a term's own square; nearly collinear terms then share the fit instead of cancelling."""
STRIBECK_SPEEDS = (0.05, 0.15, 0.4)
STICTION_SPEED = 0.015
PEAKS = 3
"""Number of periodogram peaks of a joint at which a wave is tried."""
HIGHEST = 6.0
"""Highest frequency (Hz) of a wave; beyond it the smoothing leaves little."""
SHORTEST_WAVE = 0.01
"""Shortest wavelength of a ripple, as a share of the joint's travel."""
MOVING = 0.03
"""Share of its higher speeds from which a joint counts as moving."""
ARM = 0.01
"""Change (m) of the arm of load-dependent friction for a finite difference."""
LIMITS = (0.9, 0.75, 0.6, 0.45)
LEAST_GAIN_ERROR = 0.02
"""Relative residual of the controller's law above which the controller itself is taken to be wrong."""


def ranked_effects(trace: Trace, model: Model) -> list[Place]:
    """Effects, the most likely first.

    Args:
        trace: position and drive of the modelled joints, evenly sampled; set points, where they are to be judged.
        model: what the arm is taken to be.
    """
    scores: dict[Place, float] = {}
    for place, score in (*_controller_scores(trace, model), *_torque_scores(trace, model)):
        scores[place] = max(scores.get(place, 0.0), score)
    return sorted(scores, key=lambda place: -scores[place])


def _torque_scores(trace: Trace, model: Model) -> Iterator[tuple[Place, float]]:
    base = torques_along(model, _as_it_acts(trace, model), WINDOW)
    assert base.residual is not None
    target = base.residual
    nuisances = _tolerances(trace, model, target)
    keep = _moving(base)
    size = np.array([column[kept].std() for column, kept in zip(target.T, keep.T, strict=True)])
    y = _stacked(target / size, keep)
    solve = _answered(_stacked_columns([n / size for n in nuisances], keep))
    y = y - solve(y)
    left = np.zeros_like(target)
    left.T[keep.T] = y
    terms = list(_terms(trace, model, base, target, left * size))
    library = _stacked_columns([column / size for _, column in terms], keep)
    library = library - solve(library)
    norms = np.linalg.norm(library, axis=0)
    used = norms > 1e-6 * np.sqrt(len(y))
    places = [place for (place, _), u in zip(terms, used, strict=True) if u]
    normalised = library[:, used] / norms[used] * np.sqrt(len(y))
    yield from _survivors(normalised, y, places)


def _survivors(library: Floats, y: Floats, places: list[Place | None]) -> Iterator[tuple[Place, float]]:
    """Each place with the highest threshold that one of its terms survives, and its coefficient for ties.

    Terms without a place only take their part of the residual.
    """
    triangle = np.asarray(np.linalg.qr(np.column_stack([library, y]), mode="r"))  # the same least squares, fewer rows
    count, library, y = len(y), triangle[:, :-1], triangle[:, -1]
    for threshold in THRESHOLDS:
        optimizer = pysindy.STLSQ(threshold=float(threshold), alpha=RIDGE * count, max_iter=30)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "all coefficients eliminated" is an answer here
            optimizer.fit(library, y[:, None])
        coefficients = np.abs(np.asarray(optimizer.coef_).ravel())
        for k in np.flatnonzero(coefficients > 0):
            if (place := places[k]) is not None:
                yield place, float(threshold + 1e-3 * coefficients[k])


def _as_it_acts(trace: Trace, model: Model) -> Trace:
    """The trace with its drive at the times at which it acts, smoothed as the motion is.

    A controller answers the noise of its readings with far more drive than the motion asks for.
    """
    assert trace.drive is not None
    drive = _smooth(trace.drive, float(np.median(np.diff(trace.time))))
    held = 0.5 * float(model.vector[at.PERIOD]) if holds_drive_between_samples(model.machine) else 0.0
    for j, joint in enumerate(model.machine.modelled_joints):
        late = held + float(model.vector[at.DELAY] + model.vector[at.slot(j + 1, at.EXTRA_DELAY)])
        column = trace.column(joint)
        drive[:, column] = np.interp(trace.time - late, trace.time, drive[:, column])
    return replace(trace, drive=drive)


def _moving(base: TorquesAlongTrace) -> Mask:
    """Samples (m, n) in which a joint moves, the whole window that smooths them through.

    At rest friction takes whatever value holds the joint, so that the torque says nothing.
    """
    speed, window = np.abs(base.velocity), round(WINDOW / float(np.median(np.diff(base.time)))) | 1
    moving = speed > MOVING * np.quantile(speed, 0.95, axis=0)
    return np.asarray(binary_erosion(moving, np.ones((window, 1), dtype=bool)))


def _stacked(signal: Floats, keep: Mask) -> Floats:
    return np.asarray(signal.T[keep.T])


def _stacked_columns(signals: list[Floats], keep: Mask) -> Floats:
    return np.stack([_stacked(s, keep) for s in signals], axis=1)


def _answered(basis: Floats) -> Callable[[Floats], Floats]:
    """What the tolerances would take of a signal: ridge regression, coefficients in expected deviations."""
    inverse = np.linalg.inv(basis.T @ basis + np.eye(basis.shape[1]))
    return lambda signal: basis @ (inverse @ (basis.T @ signal))


def _tolerances(trace: Trace, model: Model, target: Floats) -> list[Floats]:
    """Change of the residual for each tolerance parameter moved by its expected deviation."""
    columns = []
    for p in model.parameters:
        if p.deviation is None or p.sets_torque_scale:
            continue
        step = p.deviation if p.value + p.deviation <= p.high else -p.deviation
        columns.append(_moved(model.with_values({p.name: p.value + step}), trace, target))
    return columns


def _terms(
    trace: Trace, model: Model, base: TorquesAlongTrace, target: Floats, left: Floats
) -> Iterator[tuple[Place | None, Floats]]:
    """Terms with their places. left: what the tolerances leave of the target, the residual torque, where a joint
    moves; else 0."""
    yield from _own_terms(trace, model, base, left)
    for name, values in (
        ("payload", {"mass": 0.1}),
        ("base_tilt", {"about_x": 0.02}),
        ("base_tilt", {"about_y": 0.02}),
    ):
        yield (name, None), _moved(model.with_effect(name, (), values), trace, target)
    joints = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    for j, joint in enumerate(model.machine.modelled_joints):
        for name, values in (
            ("link_mass", {"added": 0.1}),
            ("centre_of_mass", {"shift": 0.01}),
            ("weakened_magnet", {"loss": 0.05}),
            ("input_delay", {"time": 0.005}),
        ):
            yield (name, joint), _moved(model.with_effect(name, (joint,), values), trace, target)
        arm = {"arm": float(joints[j, at.COULOMB_ARM]) + ARM}
        yield ("load_dependent_friction", joint), _moved(_with_friction(model, joint, arm), trace, target)
        yield from _sensor_terms(trace, model, joint, target)


def _with_friction(model: Model, joint: int, values: dict[str, float]) -> Model:
    """The model with other load-dependent friction, which many machines state already: a share of what weighs on the
    joint."""
    name = "load_dependent_friction"
    if any(use.name == name and joint in use.joints for use in model.effects):
        return model.with_values({f"joint{joint}.{name}.{part}": value for part, value in values.items()})
    return model.with_effect(name, (joint,), values)


def _moved(model: Model, trace: Trace, target: Floats) -> Floats:
    """Change of the residual from the target to that of another model, or of a changed trace."""
    residual = torques_along(model, _as_it_acts(trace, model), WINDOW).residual
    assert residual is not None
    return residual - target


def _sensor_terms(trace: Trace, model: Model, joint: int, target: Floats) -> Iterator[tuple[Place, Floats]]:
    calibration = model.machine.joint(joint).sensor
    if calibration is None:
        return
    column, range_, zero = trace.column(joint), calibration.range.value, calibration.at_zero.value
    part = (trace.position[:, column] - zero) / range_
    errors = [("potentiometer_gain", 0.01 * range_ * (part - 0.5)), ("potentiometer_offset", 0.01 + 0.0 * part)]
    errors += [("potentiometer_nonlinearity", 0.002 * range_ * np.sin(k * np.pi * part)) for k in (1, 2, 3, 4)]
    for name, error in errors:
        position = trace.position.copy()
        position[:, column] -= error
        yield (name, joint), _moved(model, replace(trace, position=position), target)


def _own_terms(
    trace: Trace, model: Model, base: TorquesAlongTrace, left: Floats
) -> Iterator[tuple[Place | None, Floats]]:
    """Terms that act as a torque at one joint.

    Where the motor's torque or its volts make a term, they are those that the motion asks for: the noise of what was
    recorded is in the residual too, and a term that shares it explains it. A spring is a torque in proportion to the
    angle beside a constant one, which by itself is no spring: it has no place.
    """
    assert base.motor is not None
    assert trace.drive is not None
    step = float(np.median(np.diff(base.time)))
    joints = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    for j, joint in enumerate(model.machine.modelled_joints):
        if joints[j, at.TORQUE_CONSTANT] == 0:
            continue
        v, q, asked = base.velocity[:, j], base.position[:, j], (base.required - base.friction)[:, j]
        volts = trace.drive[:, trace.column(joint)]
        gain = joints[j, at.GEAR] * joints[j, at.TORQUE_CONSTANT] / joints[j, at.RESISTANCE]
        wanted = asked / gain + joints[j, at.GEAR] * joints[j, at.BACK_EMF] * v
        sign = np.tanh(v / max(0.02 * float(np.quantile(np.abs(v), 0.95)), 1e-6))
        own: list[tuple[str | None, Floats]] = [
            ("viscous_friction", v),
            ("coulomb_friction", sign),
            ("direction_dependent_friction", sign**2),
            ("gear_loss", sign * np.abs(asked)),
            ("stiction", sign * np.exp(-np.abs(v) / STICTION_SPEED)),
            ("spring_torque", q - q.mean()),
            (None, np.ones_like(q)),
            ("dead_zone", np.sign(wanted)),
            ("resistance_drift", asked * np.cumsum(base.motor[:, j] ** 2)),
            ("motor_inductance", np.gradient(asked, step)),
            ("joint_compliance", _second(base.required[:, j], step)),
            ("backlash", _second(np.tanh(base.required[:, j] / (0.05 * base.required[:, j].std())), step)),
        ]
        own += [("stribeck_friction", sign * np.exp(-np.abs(v) / speed)) for speed in STRIBECK_SPEEDS]
        own += _waves(base, left, j)
        largest = float(np.abs(volts).max())
        own += [("supply_limit", np.sign(volts) * np.maximum(np.abs(volts) - s * largest, 0.0)) for s in LIMITS]
        for name, signal in own:
            column = np.zeros_like(base.velocity)
            column[:, j] = _smooth(signal, step) if name in ("dead_zone", "supply_limit") else signal
            if np.abs(column).max() > 0:
                yield None if name is None else (name, joint), column


def _waves(base: TorquesAlongTrace, left: Floats, j: int) -> Iterator[tuple[str, Floats]]:
    """Sines and cosines over angle and time, of the cycles and frequencies at which the residual has its peaks."""
    moving, speed = left[:, j] != 0, np.abs(base.velocity[:, j])
    if not moving.any():
        return
    travel, length = float(np.ptp(base.position[moving, j])), float(np.ptp(base.time))
    highest = 2 * np.pi * min(HIGHEST / float(np.quantile(speed[moving], 0.25)), 1 / (SHORTEST_WAVE * travel))
    for name, along, span, low, high in (
        ("torque_ripple", base.position[:, j], travel, 2 * np.pi / travel, highest),
        ("periodic_disturbance", base.time, length, 4 * np.pi / length, 2 * np.pi * HIGHEST),
    ):
        for rate in _peaks(along[moving], left[moving, j], np.arange(low, high, np.pi / (2 * span))):
            yield from ((name, wave(rate * along)) for wave in (np.sin, np.cos))


def _peaks(along: Floats, signal: Floats, rates: Floats) -> Floats:
    """The rates (rad a unit of `along`) of the highest peaks of a signal's periodogram (Lomb 1976, Scargle 1982)."""
    power = np.pad(np.asarray(lombscargle(along, signal - signal.mean(), rates)), 1)
    tops, _ = find_peaks(power)
    return np.asarray(rates[tops[np.argsort(-power[tops])][:PEAKS] - 1])


def _smooth(signal: Floats, step: float) -> Floats:
    return np.asarray(savgol_filter(signal, max(5, round(WINDOW / step)) | 1, 3, axis=0))


def _second(signal: Floats, step: float) -> Floats:
    return np.asarray(savgol_filter(signal, max(5, round(WINDOW / step)) | 1, 3, deriv=2, delta=step))


def _controller_scores(trace: Trace, model: Model) -> Iterator[tuple[Place, float]]:
    """The recorded drive against the controller's law of the recorded set points and positions."""
    controller = model.machine.controller
    if trace.set_point is None or trace.drive is None or not isinstance(controller, BoardPid):
        return
    for joint in model.machine.modelled_joints:
        c = trace.column(joint)
        error = trace.set_point[:, c] - trace.position[:, c]
        volts = trace.drive[:, c]
        within = np.abs(volts) < 0.95 * np.abs(volts).max()
        change = np.diff(trace.set_point[:, c], prepend=trace.set_point[0, c])
        gain = _nominal_gain(trace, model, joint)
        y = (volts - gain * error)[within]
        library = np.stack([gain * error, -gain * change], axis=1)[within]
        if y.std() < LEAST_GAIN_ERROR * volts.std():
            continue
        norms = np.linalg.norm(library, axis=0) / np.sqrt(len(y)) + 1e-12
        coefficients = np.linalg.lstsq(library / norms, y, rcond=None)[0] / max(volts[within].std(), 1e-12)
        for name, coefficient in zip(("wrong_gain", "lost_set_points"), coefficients, strict=True):
            yield (name, joint), float(10 * abs(coefficient))


def _nominal_gain(trace: Trace, model: Model, joint: int) -> float:
    """Volts a rad of the joint's proportional gain, as the machine or the record states it."""
    controller, machine_joint = model.machine.controller, model.machine.joint(joint)
    assert isinstance(controller, BoardPid)
    assert machine_joint.sensor is not None
    recorded = (trace.record.gains or {}).get(joint)
    gain = recorded[0] if recorded else controller.gains[joint - 1][0]
    counts = 2**machine_joint.sensor.bits / machine_joint.sensor.range.value
    volts = machine_joint.dc_motor.scale.counts_to_volts(1.0)
    return float(gain * controller.dac_counts_per_adc_count.value * counts * volts)


@dataclass(frozen=True)
class Scored:
    """A detectable single effect of a trial: the trace that was diagnosed, the truth, and how the diagnosis did."""

    trace: Path
    effect: str
    joints: frozenset[int]
    named_right: bool
    in_first: bool
    joint_right: bool


def _scored(folder: Path) -> list[Scored]:
    """Cases of a folder that `daq blind` has scored. Raises OSError for any other."""
    recorded = {row["seed"]: row for row in _rows(folder / "record.jsonl")}
    return [
        Scored(
            folder / "traces" / recorded[row["seed"]]["trace"],
            row["known_as"][0],
            frozenset(row["joints"][0]),
            row["named_right"],
            row["in_first"],
            bool(row["joint_right"]),
        )
        for row in _rows(folder / "score.jsonl")
        if row["kind"] == "single" and row["detectable"]
    ]


def _rows(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()]


def main(arguments: list[str]) -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks sparse_regression")
    parser.add_argument("traces", nargs="*", type=Path)
    parser.add_argument("--trial", type=Path, help="folder of a trial that daq blind has run")
    parser.add_argument("--quick", action="store_true", help="every fifth case")
    options = parser.parse_args(arguments)
    if options.trial is not None and not (options.trial / "score.jsonl").is_file():
        parser.error(f"--trial {options.trial}: no score.jsonl there; a folder that `daq blind` has scored is needed")
    for path in options.traces:
        try:
            ranked = _ranked(path)
        except TraceError as error:
            parser.error(str(error))
        print(path, *(_spoken(p) for p in ranked[:5]), sep="\n  ")
    return 0 if options.trial is None else _beside_the_diagnosis(_scored(options.trial)[:: 5 if options.quick else 1])


def _ranked(path: Path) -> list[Place]:
    trace = read_trace(path)
    assert trace.record.machine is not None
    return ranked_effects(trace, base_model(trace.record.machine))


def _beside_the_diagnosis(cases: Sequence[Scored]) -> int:
    first = three = joint_right = 0
    begun = time.process_time()
    for case in cases:
        ranked = _ranked(case.trace)
        names = list(dict.fromkeys(n for n, _ in ranked))
        first += names[:1] == [case.effect]
        three += case.effect in names[:3]
        joint_right += bool(ranked) and (not case.joints or ranked[0][1] in case.joints)
        print(f"{case.trace.name} {case.effect:<30} {', '.join(_spoken(p) for p in ranked[:3])}", flush=True)
    n, right = len(cases), sum(c.named_right for c in cases)
    seconds = (time.process_time() - begun) / max(1, n)
    beside = "daq diagnose of that trial: "
    figures = [
        Figure("named right", f"{first} of {n}", "≤ half of the diagnosis'", 2 * first <= right, f"{beside}{right}"),
        Figure("right name in the first three", f"{three} of {n}", beside=f"{beside}{sum(c.in_first for c in cases)}"),
        Figure("joint right", f"{joint_right} of {n}", beside=f"{beside}{sum(c.joint_right for c in cases)}"),
        Figure("processor time a case", f"{seconds:.1f} s"),
    ]
    return show(
        "Sparse regression naming hidden effects", "python -m benchmarks sparse_regression --trial FOLDER", figures
    )


def _spoken(place: Place) -> str:
    return place[0] + ("" if place[1] is None else f" {place[1]}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
