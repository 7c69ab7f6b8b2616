"""The last stage of a blind trial: what the records could tell apart, worked out once answers are sealed and scored."""

import json
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from daq.contracts.machine import load_machine
from mock_controller.hidden.experiment import read_experiment
from model.trial.arms import compose
from tests.daq.executors.by_hand import WorkersByHand
from tests.daq_cli.invoke import CommandLine
from tests.model.trial.answers import answer, step
from tests.trials.blind.test_blind import short
from trials.blind import sharpness
from trials.blind.campaign import Campaign
from trials.blind.experiments import write_experiment
from trials.blind.folder import TrialFolder
from trials.blind.mock_side import TrialStageError, reveal
from trials.blind.sharpness import rivals_wanted, work_out_sharpness

MACHINE = load_machine("ma2000")
SEED = compose(7654321, "single", "nominal")
pytestmark = pytest.mark.timeout(300)


@pytest.fixture(scope="module")
def hidden() -> dict[str, Any]:
    (effect,) = reveal(SEED)["effects"]
    found: dict[str, Any] = effect
    return found


def rival_of(hidden: dict[str, Any]) -> str:
    return "input_delay" if hidden["effect"] != "input_delay" else "motor_inductance"


def answered(path: Path, hidden: dict[str, Any], *, group: bool = True) -> TrialFolder:
    """A trial of one arm whose answer has been sealed: a group with the right name in it, or that name alone."""
    folder = TrialFolder.open(path, "ramp", False, None)
    names = (hidden["effect"], rival_of(hidden)) if group else ()
    found = step(hidden["effect"], *hidden["joints"], group=names)
    text = answer("ambiguous" if group else "named", found).model_dump_json().encode()
    (path / "answers" / "a.json").write_bytes(text)
    effects = [{"effect": hidden["effect"], "d_prime": 20.0}]
    folder.add("detect", {"seed": SEED, "load_kg": None, "d_prime": 20.0, "effects": effects})
    folder.add("record", {"seed": SEED, "outcome": "complete"})
    sealed = {"answer": "a.json", "sha256": sha256(text).hexdigest(), "seconds": 5.0, "traces": ["1.mcap"]}
    folder.add("diagnose", {"seed": SEED, **sealed})
    return folder


def scored(path: Path, hidden: dict[str, Any], *, group: bool = True) -> Campaign:
    campaign = Campaign(answered(path, hidden, group=group), MACHINE, until="sharpness", experiment=short)
    campaign.folder.add("score", campaign._score(SEED))
    return campaign


def test_d_prime_of_the_rivals_that_a_group_names_is_worked_out_once_and_counted(
    tmp_path: Path, hidden: dict[str, Any]
) -> None:
    campaign = scored(tmp_path, hidden)
    assert rivals_wanted(campaign.folder) == [SEED]
    (before,) = [line for line in campaign.table().lines if line.what.startswith("as sharp")]
    assert before.what == "as sharp as the record allows (1 not worked out)"
    for _ in range(2):
        assert campaign.run([SEED], WorkersByHand(), lambda _number, _said: None) == 0
    (line,) = (tmp_path / "sharpness.jsonl").read_text("utf-8").splitlines()
    (rival,) = json.loads(line)["rivals"]
    assert rival["effect"] == rival_of(hidden)
    (after,) = [line for line in campaign.table().lines if line.what.startswith("as sharp")]
    assert after.what == "as sharp as the record allows"
    assert (after.rate.hits, after.rate.cases) == (int(rival["d_prime"] < 5.0), 1)
    assert campaign.scores()[0].rivals == {rival_of(hidden): rival["d_prime"]}


def test_nothing_is_worked_out_before_the_answer_is_sealed_and_scored_or_for_another_answer(
    tmp_path: Path, hidden: dict[str, Any]
) -> None:
    folder = TrialFolder.open(tmp_path / "empty", "ramp", False, None)
    with pytest.raises(TrialStageError, match="no answer has been sealed"):
        work_out_sharpness(folder, SEED, MACHINE, short)
    folder = answered(tmp_path / "answered", hidden)
    with pytest.raises(TrialStageError, match="has not been scored"):
        work_out_sharpness(folder, SEED, MACHINE, short)
    (folder.path / "answers" / "a.json").write_text("{}", "utf-8")
    with pytest.raises(TrialStageError, match="differs from the one that was sealed"):
        work_out_sharpness(folder, SEED, MACHINE, short)


def test_the_command_refuses_before_there_are_answers_and_beside_other_arms(
    daq: CommandLine, empty_folder: Path, hidden: dict[str, Any]
) -> None:
    words = ("blind", "--folder", "trial", "--sharpness")
    daq(*words).complains(2, "trial.json: cannot be read")
    answered(empty_folder / "trial", hidden)
    daq(*words).complains(2, "no answer has been sealed and scored; --sharpness comes after the answers")
    daq(*words, "--seeds", "1:2").complains(2, "--seeds and --sharpness: the arms are those of the folder")


def test_the_command_prints_the_table_of_the_trial_in_the_folder(
    daq: CommandLine, empty_folder: Path, hidden: dict[str, Any]
) -> None:
    scored(empty_folder / "trial", hidden, group=False)
    printed = daq("blind", "--folder", "trial", "--sharpness", "--seconds", "0").out
    assert "| as sharp as the record allows | 1/1 = 100.0 % (2.5–100.0) | ≥ 95 % |" in printed
    assert not (empty_folder / "trial" / "sharpness.jsonl").exists()


def test_experiments_that_were_asked_for_are_taken_together_with_their_gains(
    tmp_path: Path, hidden: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = scored(tmp_path, hidden)
    campaign.folder.add("diagnose", campaign.folder.row("diagnose", SEED) | {"traces": ["1.mcap", "2.mcap"]})
    further = short("more").model_copy(update={"gains": {2: (4, 0, 0)}})
    found = SimpleNamespace(record=SimpleNamespace(spec=further))
    monkeypatch.setattr(sharpness, "read_trace", lambda file: found if file.name == "2.mcap" else None)
    given: dict[str, Any] = {}

    def tell_apart(seed: int, files: list[Path], rivals: Any, cache: Path) -> dict[str, Any]:
        given.update(seed=seed, gains=[read_experiment(file).gains_by_joint[1] for file in files], rivals=rivals)
        return {"seed": seed, "rivals": []}

    monkeypatch.setattr(sharpness, "tell_apart", tell_apart)
    work_out_sharpness(campaign.folder, SEED, MACHINE, short)
    assert given["gains"] == [(2, 0, 0), (4, 0, 0)]
    assert given["rivals"] == ((rival_of(hidden), tuple(hidden["joints"])),)


def test_an_experiment_that_was_asked_for_and_is_no_longer_known_is_said(
    tmp_path: Path, hidden: dict[str, Any]
) -> None:
    campaign = scored(tmp_path, hidden)
    campaign.folder.add("diagnose", campaign.folder.row("diagnose", SEED) | {"traces": ["1.mcap", "2.mcap"]})
    with pytest.raises(TrialStageError, match="a requested experiment is not known"):
        campaign._carry_out(SimpleNamespace(folder=campaign.folder, stage="sharpness", seed=SEED))


def test_the_mock_reads_an_experiment_as_it_is_planned(tmp_path: Path) -> None:
    made = read_experiment(write_experiment(short("ramp"), MACHINE, tmp_path / "ramp.json"))
    assert made.gains_by_joint == ((2, 0, 0),) * 6
    assert len(made.set_points) / 50 == pytest.approx(0.6, abs=0.1)
