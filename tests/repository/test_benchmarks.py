"""Benchmarks tell a missed target by their exit code, treat rivals alike, and reach no robot but their own."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

import benchmarks.__main__ as listing
from benchmarks.feedforward import LEARNED, figures, hidden_effects
from benchmarks.fitting import REPEATS, Run, beside_ours, best_in_turn
from benchmarks.stop_latency import stop_command
from benchmarks.undetected_damage import BOUND, WITHIN, Rate, verdict
from daq.contracts.machine import load_machine
from model.machine_model.model import base_model
from model.simulation.prepared import Options, prepare
from tests.firmware.compiled import need
from tests.model.simulation.effect_cases import everything
from tests.model.simulation.records import ramp_inputs


@pytest.mark.parametrize("name", ["startup", "main-job"])
@pytest.mark.parametrize(("ended", "code"), [(0, 0), (1, 1), (-9, 1)])
def test_a_benchmark_that_a_signal_ended_has_met_no_target(name: str, ended: int, code: int) -> None:
    def run(command: list[str], **_: object) -> Any:
        return subprocess.CompletedProcess(command, ended if "benchmarks.startup" in command else 0)

    assert listing.main([name], run) == code


def test_the_stop_that_is_measured_knows_no_robot_of_the_caller(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It freezes what is configured: with the caller's settings that would be a real arm."""
    told: dict[str, Any] = {}

    def run(command: list[str], **options: Any) -> Any:
        told.update(options)
        return subprocess.CompletedProcess(command, 0)

    for name in ("DAQ_ROBOT__PORT", "DAQ_SERVER", "DAQ_CONFIG", "daq_robot__port", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, "the caller's")
    assert stop_command(tmp_path, run) == 0
    assert told["cwd"] == tmp_path
    assert {name for name in told["env"] if name.upper().startswith("DAQ_")} == {"DAQ_RUNTIME_FOLDER"}
    assert "the caller's" not in told["env"].values()


def test_damage_is_within_the_bound_when_its_whole_interval_is() -> None:
    frames = 4_000_000
    expected = round(BOUND * frames)
    low, near, above = Rate(frames, 0), Rate(frames, expected), Rate(frames, 2 * expected)
    assert verdict({"a": low, "b": near}) == WITHIN
    assert verdict({"a": low, "b": low, "c": low, "d": above}) == "ABOVE THE BOUND: d"
    assert verdict({"a": near}).startswith("NOT SHOWN")


def test_every_fit_warms_up_and_has_as_many_turns() -> None:
    turns: list[str] = []

    def fit(name: str, *seconds: float) -> Any:
        left = list(seconds)

        def run() -> Run:
            turns.append(name)
            return Run(left.pop(0), 1.0, 1.0, 1)

        return run

    found = best_in_turn({"one": fit("one", 1, 5, 4, 6), "other": fit("other", 1, 3, 9, 8), "absent": lambda: "no"})
    assert turns == ["one", "other"] * (1 + REPEATS)
    assert [found[name] for name in ("one", "other", "absent")] == [Run(4, 1.0, 1.0, 1), Run(3, 1.0, 1.0, 1), "no"]


def test_a_rival_that_ends_at_a_larger_error_is_told_to() -> None:
    own = Run(1.0, 1.0, 1.0, 7)
    short = "it did not get as far as ours"
    assert short in beside_ours("rival", own, Run(30.0, 30.0, 1.1, 99), 10.0, 1.001).beside
    assert short not in beside_ours("rival", own, Run(30.0, 30.0, 1.001, 99), 10.0, 1.001).beside


def test_a_missed_target_of_the_simulation_is_its_exit_code(monkeypatch: pytest.MonkeyPatch) -> None:
    from benchmarks import simulation
    from benchmarks.figures import at_most

    monkeypatch.setattr("sys.argv", ["simulation"])
    for part in ("_scaling", "_first_use"):
        monkeypatch.setattr(simulation, part, lambda *_: [])
    monkeypatch.setattr(simulation, "_step_sizes", lambda *_: None)
    for value, code in ((1.0, 0), (2.0, 1)):
        monkeypatch.setattr(simulation, "_one_run", lambda *_, value=value: [at_most("a run", value, 1.3, "× C")])
        assert simulation.main() == code


def test_the_simulation_in_c_that_ours_is_timed_against_compiles_and_moves_every_arm_as_ours_does() -> None:
    from benchmarks.simulation import c_runs, check_agreement, our_runs

    need("gcc")
    bare = base_model(load_machine("ma2000"))
    prepared = prepare(bare, ramp_inputs(bare.machine, duration=0.5), Options())
    full = everything(bare, ("backlash", "joint_compliance"))  # not in C: transmissions that give
    in_c = c_runs(bare, prepared, 1, "-O0")
    check_agreement(our_runs(bare, prepared, 1), in_c)
    check_agreement(our_runs(full, prepared, 1), c_runs(full, prepared, 1, "-O0"))
    with pytest.raises(AssertionError, match="disagree by"):
        check_agreement(our_runs(full, prepared, 1), in_c)


def test_arms_that_follow_badly_miss_the_targets_of_following_a_motion() -> None:
    def arm(fitted: float, last: float) -> dict[str, Any]:
        rms = {"plain": 1.0, "fitted": fitted, "diagnosed": 0.05}
        rms |= {f"learned {k}": 0.1 for k in range(1, LEARNED)} | {f"learned {LEARNED}": last}
        run = {label: {"rms": one, "largest": 3 * one, "expected": one} for label, one in rms.items()}
        return {"seed": 1, "hidden": hidden_effects(1), "named": ["x"], "runs": {"sine": run}}

    def missed(*arms: dict[str, Any]) -> int:
        return sum(figure.met is False for figure in figures(arms))

    assert hidden_effects(1) == hidden_effects(1) != hidden_effects(2)
    size, doubled = (float(re.findall(r",\w+=(-?[\d.]+)", hidden_effects(1, t)[0])[0]) for t in (1.0, 2.0))
    assert doubled == pytest.approx(2 * size, abs=2e-3)
    assert hidden_effects(1, 2.0)[1:] == hidden_effects(1)[1:], "the load is the same"
    assert missed(arm(0.06, 0.1)) == 0
    assert missed(arm(0.06, 0.1), arm(0.4, 0.1)) == 1, "a third of the plain error is exceeded"
    assert missed(arm(0.06, 0.1), arm(0.06, 0.2)) == 1, "the last attempt is worse than the one before"
    assert missed(arm(0.04, 0.1)) == 1, "the diagnosis has made it worse"
