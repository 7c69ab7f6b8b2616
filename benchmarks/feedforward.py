"""Tracking errors of plain set points, of those from models, and of learned ones, on arms with hidden effects.

    python -m benchmarks feedforward --first 101 --arms 8       seeds 101 to 108

Every seed is an arm of its own: its parameters are drawn from what the machine file expects (value ± deviation), it
carries a hidden load, and one joint has a hidden friction, of a kind and size that the seed draws. All of it is the
mock's, which shares no code with the model. Each of three motions, on all joints at once, is run

- with plain set points;
- with set points computed from the machine file, nothing fitted;
- with set points computed from the model that `daq fit` makes of two other records of the arm;
- the same after `daq diagnose` has looked for the missing effect in these records;
- with set points learned from the trace before, several times, without any model: from plain ones;
- with set points learned once, with the diagnosed model's response, from the trace of its own set points.

Errors are those of the readings, against the motion in the same period, no delay forgiven, over the whole record and
all three joints.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.figures import Figure, at_most, show
from benchmarks.mock_arm import hidden_parameters, plant_text, recorded
from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec, Feedforward, parse_spec
from daq.contracts.machine import load_machine
from daq.contracts.trace import Floats, Trace
from daq.safety.planned import motion_of, planned
from daq.trajectories.presets import preset
from extras.motion.inverse import feedforward
from extras.motion.learning import learn
from extras.motion.tracking import followed
from model.discrepancy.workflow import diagnose
from model.fitting.fit import fit
from model.machine_model.model import Model, base_model

MACHINE = load_machine("ma2000")
FRICTION: dict[str, tuple[tuple[float, float], ...]] = {
    "coulomb_friction": ((2.0, 5.0), (4.0, 9.0), (0.8, 1.8)),
    "viscous_friction": ((35.0, 60.0), (50.0, 80.0), (15.0, 30.0)),
    "stribeck_friction": ((2.0, 5.0), (4.0, 10.0), (1.0, 2.5)),
    "direction_dependent_friction": ((1.2, 3.0), (5.0, 12.0), (1.2, 3.0)),
    "stiction": ((5.0, 12.0), (7.0, 16.0), (2.5, 6.0)),
}
"""Hidden frictions, and for joints 1 to 3 the range from which a size is drawn (N·m, or N·m·s/rad): the upper half of
the range for a secret arm of the mock.
"""
SIZES = {"viscous_friction": "coefficient", "stiction": "breakaway"}
"""Name of the size, if it is not `torque`."""
PAYLOAD = (0.25, 0.8)
"""Hidden load, kg, in addition to the stated 1.25 kg."""
FLOOR = 0.1
"""Error (°), a third of a posture unit, below which attempts differ by chance."""
LEARNED = 4
"""Attempts that learn from the previous one."""


def _spec(trajectory: Mapping[str, Any], name: str, **others: Any) -> ExperimentSpec:
    return parse_spec({"trajectory": trajectory, "joints": [1, 2, 3], "name": name, "hold": 1.0, **others})


def _by_joint(*degrees: float) -> dict[int, float]:
    return dict(enumerate(np.radians(degrees).tolist(), start=1))


MOTIONS = {
    "ramp": preset("ramp").spec,
    "sine": _spec(
        {"kind": "sine", "amplitude": _by_joint(20, 12, 20), "period": 3.0, "cycles": 2, "phase": 0.7}, "sine"
    ),
    "via": _spec(
        {
            "kind": "via",
            "points": [_by_joint(25, 15, -30), _by_joint(40, -5, 20), _by_joint(10, 20, 35), _by_joint(0, 0, 0)],
            "times": [1.2, 2.4, 3.6, 5.0],
        },
        "via",
    ),
}
"""The source's ramp, sines that reverse, and a smooth motion through other postures."""


def hidden_effects(seed: int) -> tuple[str, ...]:
    """Returns the mock's modifications for a seed: a friction at a joint, and a load."""
    rng = np.random.default_rng([8, seed])
    kind = str(rng.choice(list(FRICTION)))
    joint = int(rng.integers(1, 4))
    low, high = FRICTION[kind][joint - 1]
    size = low * (high / low) ** rng.random()
    sign = -1 if kind == "direction_dependent_friction" and rng.random() < 0.5 else 1
    mass = rng.uniform(*PAYLOAD)
    extra = {"stribeck_friction": ",speed=0.2", "stiction": ",speed=0.02"}.get(kind, "")
    friction = f"{kind}:joint={joint},{SIZES.get(kind, 'torque')}={sign * size:.3f}{extra}"
    return friction, f"payload:mass={mass:.3f}"


def study(seed: int) -> dict[str, Any]:
    """Returns errors of every method on one arm."""
    effects, plant = hidden_effects(seed), plant_text(hidden_parameters(MACHINE, seed))
    noise = iter(range(1000 * seed, 1000 * seed + 1000))

    def run(specs: Sequence[ExperimentSpec]) -> list[Trace]:
        return recorded(specs, MACHINE, next(noise), plant, modify=effects)

    records = run([preset("diagnostic").spec, preset("held-out").spec])
    fitted = fit(base_model(MACHINE), records).model
    answer = diagnose(base_model(MACHINE), records[:1], records[1:])
    runs: dict[str, dict[str, Any]] = {}
    models = {"nominal": base_model(MACHINE), "fitted": fitted, "diagnosed": answer.model_after}
    for name, spec in MOTIONS.items():
        plain = run([spec])[0]
        computed = {label: _computed(model, spec) for label, model in models.items()}
        traces = {"plain": plain, **dict(zip(computed, run(list(computed.values())), strict=True))}
        corrected = learn(traces["diagnosed"], MACHINE, _plan, answer.model_after)
        traces["diagnosed, learned once"] = run([corrected])[0]
        last = plain
        for attempt in range(1, LEARNED + 1):
            last = traces[f"learned {attempt}"] = run([_learned(last)])[0]
        runs[name] = {label: _judged(trace) for label, trace in traces.items()}
    named = [f"{step.effect} on {list(step.joints)}" for step in answer.steps if step.adopted]
    return {"seed": seed, "hidden": effects, "verdict": answer.verdict, "named": named, "runs": runs}


def _plan(spec: ExperimentSpec) -> Floats:
    return planned(spec, MACHINE)


def _computed(model: Model, spec: ExperimentSpec) -> ExperimentSpec:
    return feedforward(model, spec, MACHINE, _plan)


def _learned(trace: Trace) -> ExperimentSpec:
    """Returns the next attempt; if learning reports divergence, the present set points again."""
    try:
        return learn(trace, MACHINE, _plan)
    except TraceError as error:
        print(f"  {error}", file=sys.stderr)
        assert trace.record.spec is not None
        return trace.record.spec


def _judged(trace: Trace) -> dict[str, Any]:
    """Returns errors of a trace in degrees: over all joints, and the expected one."""
    found = followed(trace, lambda spec: motion_of(spec, MACHINE))
    assert found is not None
    assert trace.record.spec is not None
    missed = np.degrees(found.wanted - found.reached)
    source = trace.record.spec.feedforward
    return {
        "rms": float(np.sqrt(np.square(missed).mean())),
        "largest": float(np.abs(missed).max()),
        "expected": None if source is None else _together(source),
    }


def _together(source: Feedforward) -> float:
    return float(np.degrees(np.sqrt(np.mean([error.rms**2 for error in source.expected.values()]))))


def _line(entry: dict[str, Any]) -> str:
    shares = {label: _shares([entry], label)[0] for label in _labels(entry)}
    told = ", ".join(f"{label} {share:.3f}" for label, share in shares.items())
    return f"  seed {entry['seed']} ({', '.join(entry['hidden'])}; {entry['verdict']}: {entry['named']}): {told}"


def _labels(entry: dict[str, Any]) -> list[str]:
    return list(next(iter(entry["runs"].values())))


def _rms(entry: dict[str, Any], label: str) -> float:
    """Returns the rms error (°) of a method over all motions of an arm."""
    return float(np.sqrt(np.mean([run[label]["rms"] ** 2 for run in entry["runs"].values()])))


def _shares(entries: Sequence[dict[str, Any]], label: str) -> list[float]:
    return [_rms(entry, label) / _rms(entry, "plain") for entry in entries]


def figures(entries: Sequence[dict[str, Any]]) -> list[Figure]:
    """Returns medians over the arms, with the worst arm."""
    found = []
    for label in _labels(entries[0]):
        rms = [_rms(entry, label) for entry in entries]
        most = [max(run[label]["largest"] for run in entry["runs"].values()) for entry in entries]
        shares = _shares(entries, label)
        beside = f"of plain {np.median(shares):.3f}, worst arm {max(shares):.3f}; largest error {np.median(most):.2f}°"
        found.append(Figure(f"{label}: rms error, median arm", f"{np.median(rms):.3f}°", beside=beside))
    better = [_rms(e, "diagnosed") / _rms(e, "fitted") for e in entries if e["named"]]
    expected = [run[m]["expected"] / run[m]["rms"] for e in entries for run in e["runs"].values() for m in COMPUTED]
    found.append(at_most("fitted model: worst share of plain", max(_shares(entries, "fitted")), 1 / 3, ""))
    if better:
        found.append(at_most("diagnosed over fitted, median where one is named", float(np.median(better)), 1.0, ""))
    pairs = [pair for e in entries for run in e["runs"].values() for pair in zip(*_learning(run), strict=True)]
    growth = max((after / before for before, after in pairs if after > FLOOR), default=0.0)
    found.append(at_most(f"learning: largest growth to an error above {FLOOR}°", growth, 1.1, ""))
    spread = f"{np.quantile(expected, 0.1):.2f} to {np.quantile(expected, 0.9):.2f} in 8 of 10"
    found.append(Figure("expected error over the one reached, median", f"{np.median(expected):.2f}", beside=spread))
    return found


COMPUTED = ("fitted", "diagnosed")


def _learning(run: dict[str, Any]) -> tuple[list[float], list[float]]:
    """Returns errors of the attempts, and of those after them."""
    errors = [run["plain"]["rms"], *(run[f"learned {k}"]["rms"] for k in range(1, LEARNED + 1))]
    return errors[:-1], errors[1:]


def main(arguments: list[str]) -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks feedforward", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--first", type=int, default=101, help="the first seed")
    parser.add_argument("--arms", type=int, default=6, help="number of arms")
    chosen = parser.parse_args(arguments)
    entries: list[dict[str, Any]] = []
    for seed in range(chosen.first, chosen.first + chosen.arms):
        entries.append(study(seed))
        print(_line(entries[-1]), file=sys.stderr, flush=True)
    command = f"python -m benchmarks feedforward --first {chosen.first} --arms {len(entries)}"
    return show(f"Following a motion: {len(entries)} arms, {len(MOTIONS)} motions each", command, figures(entries))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
