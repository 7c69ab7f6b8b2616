"""A registered trial of worlds: which arm comes next, what an arm is worth, and the table of its lines."""

import json
from pathlib import Path
from typing import Any

import pytest

import trials.registered as trial

REGISTRATION = trial.RigsRegistration(
    version=1, title="", kinds=("axis-pid", "planar-pid"), cases=("sound", "single"), longest=10.0, hashes={}
)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int, str]]:
    """Arms that were made, without their computation: planar ones take three times as long."""
    asked: list[tuple[str, int, str]] = []

    def make(place: Path, kind: str, seed: int, case: str, longest: float) -> None:
        asked.append((kind, seed, case))
        place.mkdir(parents=True)
        hidden = [] if case == "sound" else [{"name": "backlash", "joint": 1}]
        (place / "truth.json").write_text(json.dumps({"case": case, "hidden": hidden}), "utf-8")
        spent = 3.0 if kind == "planar-pid" else 1.0
        kept = {"kind": kind, "seed": seed, "case": case, "late": True, "answer": None, "seconds": 10.0}
        (place / "answer.json").write_text(json.dumps(kept | {"spent": spent}), "utf-8")
        if len(asked) == 8:
            raise KeyboardInterrupt

    monkeypatch.setattr(trial, "make_arm", make)
    return asked


def test_the_kind_on_which_the_least_time_was_spent_comes_next(made: list[Any], tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        trial.run(REGISTRATION, "a commit", tmp_path, 60.0)
    assert [kind for kind, _, _ in made].count("axis-pid") == 6
    assert [case for kind, _, case in made if kind == "axis-pid"] == ["sound", "single"] * 3
    seeds = [seed for _, seed, _ in made]
    assert len(set(seeds)) == 8
    assert min(seeds) >= trial.FIRST_DRAWN


def test_a_process_runs_the_kinds_that_it_was_given(made: list[Any], tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        trial.run(REGISTRATION, "a commit", tmp_path, 60.0, ("planar-pid",))
    assert {kind for kind, _, _ in made} == {"planar-pid"}


def test_a_trial_goes_on_where_it_stopped_and_its_lines_are_read_again(made: list[Any], tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        trial.run(REGISTRATION, "a commit", tmp_path, 60.0)
    trial.run(REGISTRATION, "a commit", tmp_path, 0.0)
    assert len(made) == 8
    rows = trial.rows_of(tmp_path)
    assert trial.read_rows(tmp_path / "cases.csv") == rows
    assert {(row.case, row.verdict, row.strict, row.alarm) for row in rows} == {
        ("sound", "late", None, None),
        ("single", "late", False, None),
    }
    assert any("no answer in the time | | 8 | 6 | 2 |" in line for line in trial.table(rows))
